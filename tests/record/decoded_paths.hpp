// Reads report::LayerPaths as the page does, by their description.
#pragma once

#include <cstdint>
#include <vector>

#include "unflex/report/recording.hpp"

namespace unflex::record::testing {

struct DecodedPoint {
  double x_mm = 0.0, y_mm = 0.0;
  unsigned before = 0, after = 0;  // unset for the first point

  friend bool operator==(const DecodedPoint&, const DecodedPoint&) = default;
};

struct DecodedPath {
  std::size_t feature = 0, first_line = 0, last_line = 0;
  std::vector<DecodedPoint> points;
};

inline std::vector<DecodedPath> decoded(const std::string& bytes, std::size_t from,
                                        std::size_t to) {
  std::size_t at = from;
  const auto byte = [&] { return static_cast<unsigned char>(bytes.at(at++)); };
  const auto number = [&] {
    std::uint64_t value = 0;
    for (unsigned shift = 0;; shift += 7) {
      const unsigned digit = byte();
      value |= std::uint64_t{digit & 0x7FU} << shift;
      if (digit < 0x80U) {
        return value;
      }
    }
  };
  const auto signed_number = [&] {
    const auto value = static_cast<std::int64_t>(number());
    return value % 2 != 0 ? -(value + 1) / 2 : value / 2;
  };
  std::vector<DecodedPath> paths;
  std::int64_t x = 0;
  std::int64_t y = 0;
  std::int64_t line = 0;
  while (at < to) {
    DecodedPath path;
    path.feature = number();
    const std::uint64_t count = number();
    line += signed_number();
    path.first_line = static_cast<std::size_t>(line);
    path.last_line = path.first_line + number();
    for (std::uint64_t i = 0; i <= count; ++i) {
      x += signed_number();
      y += signed_number();
      DecodedPoint point{static_cast<double>(x) / 100.0, static_cast<double>(y) / 100.0};
      if (i > 0) {
        point.before = byte();
        point.after = byte();
      }
      path.points.push_back(point);
    }
    paths.push_back(std::move(path));
  }
  return paths;
}

}  // namespace unflex::record::testing
