#include <istream>
#include <ostream>
#include <streambuf>
#include <utility>

#include "unflex/core/text_store.hpp"

namespace unflex {
namespace {

// Reads a text that stays where it is.
class TextReader final : public std::streambuf {
 public:
  explicit TextReader(const std::string& text) {
    // A streambuf that is only read does not write to its text.
    char* const begin = const_cast<char*>(text.data());
    setg(begin, begin, begin + text.size());
  }

 protected:
  pos_type seekoff(off_type offset, std::ios::seekdir from, std::ios::openmode which) override {
    const char* const origin =
        from == std::ios::beg ? eback() : (from == std::ios::cur ? gptr() : egptr());
    const off_type place = origin - eback() + offset;
    if ((which & std::ios::in) == 0 || place < 0 || place > egptr() - eback()) {
      return pos_type(off_type(-1));
    }
    setg(eback(), eback() + place, egptr());
    return pos_type(place);
  }
  pos_type seekpos(pos_type place, std::ios::openmode which) override {
    return seekoff(off_type(place), std::ios::beg, which);
  }
};

class TextWriter final : public std::streambuf {
 public:
  explicit TextWriter(std::string& text) : text_(&text) {}

 protected:
  std::streamsize xsputn(const char* text, std::streamsize count) override {
    text_->append(text, static_cast<std::size_t>(count));
    return count;
  }
  int_type overflow(int_type character) override {
    if (!traits_type::eq_int_type(character, traits_type::eof())) {
      text_->push_back(traits_type::to_char_type(character));
    }
    return traits_type::not_eof(character);
  }

 private:
  std::string* text_;
};

// A stream that owns its buffer.
template <class Stream, class Buffer>
class Owning final : public Stream {
 public:
  template <class Text>
  explicit Owning(Text& text) : Stream(nullptr), buffer_(text) {
    this->rdbuf(&buffer_);
  }

 private:
  Buffer buffer_;
};

class MemoryStore final : public TextStore {
 public:
  explicit MemoryStore(std::string text) : text_(std::move(text)) {}

  [[nodiscard]] std::unique_ptr<std::istream> read() const override {
    return std::make_unique<Owning<std::istream, TextReader>>(text_);
  }

  [[nodiscard]] std::unique_ptr<std::ostream> write() override {
    text_.clear();
    return std::make_unique<Owning<std::ostream, TextWriter>>(text_);
  }

  [[nodiscard]] bool rewrite(const LineChange& change) override {
    std::string changed;
    changed.reserve(text_.size());
    change(text_, changed);
    text_ = std::move(changed);
    return true;
  }

  [[nodiscard]] std::optional<std::uint64_t> bytes() const override { return text_.size(); }

 private:
  std::string text_;
};

}  // namespace

std::shared_ptr<TextStore> memory_store(std::string text) {
  return std::make_shared<MemoryStore>(std::move(text));
}

}  // namespace unflex
