// The record of a batch in its output folder: which outputs there are, and the sources of each.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "batch_result.hpp"
#include "files.hpp"
#include "unflex/core/error.hpp"

namespace unflex::app {

inline constexpr std::string_view kManifestName = ".unflex-batch.json";
// The name of the manifest. Each shard has its own: ".unflex-batch.2-of-8.json".
[[nodiscard]] std::string manifest_name(const std::optional<Shard>& shard);

class BatchManifest {
 public:
  // Makes the folder if there is none. Claims it for this process and the processes that it forks.
  // A shard claims it together with other shards. Reads all manifests in the folder. A damaged
  // manifest, or one of another version, counts for nothing. Errors are of kind usage: the folder
  // cannot be written, or another batch works in it.
  [[nodiscard]] static Result<BatchManifest> open(const std::string& folder,
                                                  const std::optional<Shard>& shard);

  // The records of the print's output in all manifests.
  [[nodiscard]] std::vector<BatchRecord> find(const std::string& name) const;

  // Remembers the record, on the disk too before it returns. Errors are of kind internal.
  [[nodiscard]] Status put(const std::string& name, const BatchRecord& record);

 private:
  BatchManifest(std::string file, FileDescriptor claim)
      : file_(std::move(file)), claim_(std::move(claim)) {}

  void read(const std::string& file, bool is_own);

  std::string file_;
  FileDescriptor claim_;
  std::map<std::string, BatchRecord> records_;  // by key_of(name)
  std::multimap<std::string, BatchRecord> records_of_others_;
};

// A name as text: bytes that are not printable ASCII, and '%', as %XX.
[[nodiscard]] std::string key_of(std::string_view name);

}  // namespace unflex::app
