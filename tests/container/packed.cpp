#include "packed.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>

#include "paths.hpp"

namespace unflex::container {

Result<Unpacked> unpack(std::string_view bytes, std::size_t piece_bytes) {
  const std::unique_ptr<Unpacker> unpacker = make_unpacker(detect(bytes), "print");
  Unpacked unpacked;
  if (!unpacker) {
    unpacked.text = bytes;
    return unpacked;
  }
  for (bool ended = false;;) {
    const Result<std::string> text = unpacker->pull();
    if (!text) {
      return tl::unexpected(text.error());
    }
    if (!text->empty()) {
      unpacked.text += *text;
      unpacked.longest_piece = std::max(unpacked.longest_piece, text->size());
    } else if (ended) {
      break;
    } else if (bytes.empty()) {
      unpacker->finish();
      ended = true;
    } else {
      unpacker->push(bytes.substr(0, piece_bytes));
      bytes.remove_prefix(std::min(piece_bytes, bytes.size()));
    }
  }
  if (unpacker->metadata() != nullptr) {
    unpacked.metadata = *unpacker->metadata();
  }
  return unpacked;
}

Result<std::string> pack(Packer& packer, std::string_view text, std::size_t piece_bytes) {
  if (packer.wants_survey()) {
    for (std::size_t at = 0; at < text.size(); at += piece_bytes) {
      if (Status surveyed = packer.survey(text.substr(at, piece_bytes)); !surveyed) {
        return tl::unexpected(surveyed.error());
      }
    }
  }
  std::string packed;
  for (std::size_t at = 0; at < text.size(); at += piece_bytes) {
    const Result<std::string> bytes = packer.push(text.substr(at, piece_bytes));
    if (!bytes) {
      return bytes;
    }
    packed += *bytes;
  }
  return packer.finish().map([&](const std::string& bytes) { return packed + bytes; });
}

Result<std::string> to_bgcode(std::string_view text, const Metadata* origin,
                              BgcodeOptions options) {
  return pack(*make_bgcode_packer("out.bgcode", origin, options), text);
}

std::string to_gzip(std::string_view text) { return *pack(*make_gzip_packer(), text); }

std::string ten_layers(std::string_view print) {
  const Result<Unpacked> unpacked =
      unpack(test_data("prints/" + std::string(print) + "_ten_layers.gcode.gz"));
  EXPECT_TRUE(unpacked.has_value()) << print;
  return unpacked ? unpacked->text : std::string();
}

std::string test_data(std::string_view name) {
  std::ifstream stream((std::string(test_paths::kData) + "/").append(name), std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

std::string random_gcode(std::mt19937& random, std::size_t lines, bool comments) {
  const auto below = [&](std::size_t limit) { return static_cast<std::size_t>(random()) % limit; };
  const auto number = [&] {
    std::string text = below(4) == 0 ? "-" : "";
    text.append(below(3) == 0 ? "" : std::to_string(below(300)));
    return text.append(".") + std::to_string(below(100000));
  };
  static constexpr std::array<std::string_view, 8> kOthers = {
      "M117 Layer G1 of E_3 xX",
      "SET_VELOCITY_LIMIT ACCEL=5000 SQUARE_CORNER_VELOCITY=5",
      "M862.3 P \"MK4S  G 28\"",
      "G10",
      "T0",
      "  M204 S1000",
      "EXCLUDE_OBJECT NAME=GÄRTNER",
      "g1 x10 e1"};
  static constexpr std::array<std::string_view, 5> kComments = {
      ";TYPE:External perimeter", ";LAYER_CHANGE", ";Z:0.25", ";  G1 X 5 = E", "; = = ;"};
  std::string text;
  for (std::size_t i = 0; i < lines; ++i) {
    const std::size_t kind = below(10);
    if (kind == 0) {
      text += comments ? kComments[below(kComments.size())] : "M84";
    } else if (kind == 1) {
      text += kOthers[below(kOthers.size())];
    } else {
      text.append("G").append(std::to_string(below(4)));
      for (const std::string_view letter : {"X", "Y", "Z", "I", "J", "E", "F"}) {
        if (below(2) == 0) {
          (text += " ") += letter;
          text += number();
        }
      }
      text += comments && below(8) == 0 ? " ; Perimeter WIPE" : "";
    }
    text += '\n';
  }
  return text;
}

std::string essential(std::string_view text) {
  std::string kept;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    if (line.find_first_not_of("; \t\r") != std::string_view::npos) {
      (kept += line) += '\n';
    }
  }
  return kept;
}

}  // namespace unflex::container
