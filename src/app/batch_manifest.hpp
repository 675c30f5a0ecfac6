// The memory of a batch in its output folder: which outputs are there, and what each was made from.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "batch_result.hpp"
#include "files.hpp"
#include "unflex/core/error.hpp"

namespace unflex::app {

inline constexpr std::string_view kManifestName = ".unflex-batch.json";

class BatchManifest {
 public:
  // Makes the folder if there is none, claims it for this process and those it forks, and reads the
  // manifest. A manifest that is damaged or of another version counts for nothing. Errors are of
  // kind usage: the folder cannot be written, or another batch works in it.
  [[nodiscard]] static Result<BatchManifest> open(const std::string& folder);

  // What is known of the print's output.
  [[nodiscard]] std::optional<BatchRecord> find(const std::string& name) const;

  // Remembers the record, on the disk too before it returns. Errors are of kind internal.
  [[nodiscard]] Status put(const std::string& name, const BatchRecord& record);

 private:
  BatchManifest(std::string file, FileDescriptor claim)
      : file_(std::move(file)), claim_(std::move(claim)) {}

  void read();

  std::string file_;
  FileDescriptor claim_;
  std::map<std::string, BatchRecord> records_;  // by key_of(name)
};

// A name as text: bytes that are not printable ASCII, and '%', as %XX.
[[nodiscard]] std::string key_of(std::string_view name);

}  // namespace unflex::app
