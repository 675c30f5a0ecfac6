// The storage of a text: a file, or memory. The text can be read from its beginning any number of
// times.
#pragma once

#include <cstdint>
#include <functional>
#include <iosfwd>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace unflex {

// Appends the replacement of `text` to `out`. `text` consists of whole lines. Only the last line of
// the stored text may lack its ending.
using LineChange = std::function<void(std::string_view text, std::string& out)>;

class TextStore {
 public:
  TextStore() = default;
  TextStore(const TextStore&) = delete;
  TextStore& operator=(const TextStore&) = delete;
  virtual ~TextStore() = default;

  // A seekable stream at the beginning, bad if the text cannot be read.
  [[nodiscard]] virtual std::unique_ptr<std::istream> read() const = 0;
  // Empties the text. The stream is bad if it cannot be written.
  [[nodiscard]] virtual std::unique_ptr<std::ostream> write() = 0;
  // Hands the text to `change`, block by block in order, and writes what it makes of it over the
  // text. False if it cannot be read or written.
  [[nodiscard]] virtual bool rewrite(const LineChange& change) = 0;
  // The text's length. nullopt if it is not known, as for a file whose name is gone since it was
  // opened.
  [[nodiscard]] virtual std::optional<std::uint64_t> bytes() const = 0;
};

[[nodiscard]] std::shared_ptr<TextStore> memory_store(std::string text = {});

}  // namespace unflex
