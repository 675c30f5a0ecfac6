#include "heatshrink.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

namespace unflex::container {
namespace {

constexpr unsigned kLengthBits = 4;
constexpr std::size_t kLongestMatch = std::size_t{1} << kLengthBits;
constexpr unsigned kLiteralBits = 1 + 8;

// Two bytes repeated cost 17 bits instead of 18, which is not worth looking for.
constexpr std::size_t kShortestMatch = 3;
constexpr unsigned kHashBits = 14;
constexpr std::uint32_t kNowhere = std::numeric_limits<std::uint32_t>::max();
// Bounds the time on text that repeats itself. With more tries matches hardly get longer.
constexpr int kMaxTries = 256;

class BitWriter {
 public:
  void put(std::uint32_t value, unsigned count) {
    held_ = (held_ << count) | value;
    held_count_ += count;
    while (held_count_ >= 8) {
      held_count_ -= 8;
      bytes_ += static_cast<char>(held_ >> held_count_);
    }
  }

  [[nodiscard]] std::string take() {
    if (held_count_ > 0) {
      put(0, 8 - held_count_);
    }
    return std::move(bytes_);
  }

 private:
  std::string bytes_;
  std::uint64_t held_ = 0;
  unsigned held_count_ = 0;
};

class BitReader {
 public:
  explicit BitReader(std::string_view bytes) : bytes_(bytes) {}

  [[nodiscard]] std::size_t left() const { return 8 * (bytes_.size() - next_) + held_count_; }

  // count must not exceed left() nor 16.
  [[nodiscard]] std::uint32_t get(unsigned count) {
    while (held_count_ < count) {
      held_ = (held_ << 8U) | static_cast<unsigned char>(bytes_[next_++]);
      held_count_ += 8;
    }
    held_count_ -= count;
    return (held_ >> held_count_) & ((1U << count) - 1);
  }

 private:
  std::string_view bytes_;
  std::size_t next_ = 0;
  std::uint32_t held_ = 0;
  unsigned held_count_ = 0;
};

struct Match {
  std::uint16_t distance = 0;
  std::uint8_t length = 0;  // 0: none
};

// Places of equal first three bytes, newest first.
class Chains {
 public:
  explicit Chains(std::string_view bytes) : bytes_(bytes), before_(bytes.size(), kNowhere) {
    newest_.fill(kNowhere);
  }

  [[nodiscard]] Match longest(std::size_t at, std::size_t window) const {
    Match best;
    const std::size_t limit = std::min(kLongestMatch, bytes_.size() - at);
    if (limit < kShortestMatch) {
      return best;
    }
    std::uint32_t place = newest_[hash(at)];
    for (int tries = 0; place != kNowhere && at - place <= window && tries < kMaxTries; ++tries) {
      std::size_t length = 0;
      while (length < limit && bytes_[place + length] == bytes_[at + length]) {
        ++length;
      }
      if (length >= kShortestMatch && length > best.length) {
        best = {static_cast<std::uint16_t>(at - place), static_cast<std::uint8_t>(length)};
        if (length == limit) {
          break;
        }
      }
      place = before_[place];
    }
    return best;
  }

  void add(std::size_t at) {
    if (at + kShortestMatch <= bytes_.size()) {
      std::uint32_t& newest = newest_[hash(at)];
      before_[at] = newest;
      newest = static_cast<std::uint32_t>(at);
    }
  }

 private:
  [[nodiscard]] std::size_t hash(std::size_t at) const {
    const auto byte = [&](std::size_t i) {
      return static_cast<std::uint32_t>(static_cast<unsigned char>(bytes_[at + i]));
    };
    // Fibonacci hashing (Knuth, TAOCP 3, 6.4).
    return ((byte(0) << 16U | byte(1) << 8U | byte(2)) * 2654435769U) >> (32U - kHashBits);
  }

  std::string_view bytes_;
  std::array<std::uint32_t, std::size_t{1} << kHashBits> newest_;
  std::vector<std::uint32_t> before_;
};

std::vector<Match> all_matches(std::string_view bytes, std::size_t window) {
  Chains chains(bytes);
  std::vector<Match> matches(bytes.size());
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    matches[at] = chains.longest(at, window);
    chains.add(at);
  }
  return matches;
}

// The lengths with which the fewest bits are written, found from the end backwards. A match costs
// the same at any length up to its longest. Length 1 stands for a literal.
std::vector<std::uint8_t> cheapest_lengths(const std::vector<Match>& matches, unsigned match_bits) {
  std::vector<std::uint8_t> lengths(matches.size(), 1);
  std::vector<std::uint64_t> bits(matches.size() + 1, 0);
  for (std::size_t at = matches.size(); at-- > 0;) {
    bits[at] = bits[at + 1] + kLiteralBits;
    for (std::size_t length = kShortestMatch; length <= matches[at].length; ++length) {
      if (bits[at + length] + match_bits < bits[at]) {
        bits[at] = bits[at + length] + match_bits;
        lengths[at] = static_cast<std::uint8_t>(length);
      }
    }
  }
  return lengths;
}

}  // namespace

std::string heatshrink(std::string_view bytes, unsigned window_bits) {
  const std::vector<Match> matches = all_matches(bytes, std::size_t{1} << window_bits);
  const std::vector<std::uint8_t> lengths =
      cheapest_lengths(matches, 1 + window_bits + kLengthBits);
  BitWriter out;
  for (std::size_t at = 0; at < bytes.size(); at += lengths[at]) {
    if (lengths[at] == 1) {
      out.put(1, 1);
      out.put(static_cast<unsigned char>(bytes[at]), 8);
    } else {
      out.put(0, 1);
      out.put(matches[at].distance - 1U, window_bits);
      out.put(lengths[at] - 1U, kLengthBits);
    }
  }
  return out.take();
}

std::optional<std::string> unheatshrink(std::string_view packed, unsigned window_bits,
                                        std::size_t size) {
  BitReader in(packed);
  std::string bytes;
  bytes.reserve(size);
  while (bytes.size() < size) {
    if (in.left() < kLiteralBits) {
      return std::nullopt;
    }
    if (in.get(1) == 1) {
      bytes += static_cast<char>(in.get(8));
      continue;
    }
    if (in.left() < window_bits + kLengthBits) {
      return std::nullopt;
    }
    const std::size_t distance = in.get(window_bits) + 1U;
    const std::size_t length = in.get(kLengthBits) + 1U;
    if (length > size - bytes.size()) {
      return std::nullopt;
    }
    for (std::size_t i = 0; i < length; ++i) {
      bytes += distance <= bytes.size() ? bytes[bytes.size() - distance] : '\0';
    }
  }
  // The last byte is filled up; the original's encoder may add another byte.
  return in.left() < 16 ? std::optional(std::move(bytes)) : std::nullopt;
}

}  // namespace unflex::container
