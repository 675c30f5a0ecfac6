#include "stdata.hpp"

#include <fmt/core.h>
#include <zstd.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "samples.hpp"

namespace unflex::identify {
namespace {

using Json = nlohmann::json;

// Four minutes of samples are about 60 MB of text.
constexpr std::size_t kMostBytes = std::size_t{1} << 29U;

tl::unexpected<Error> broken(const std::string& file, std::string_view why) {
  return fail(ErrorKind::input, {file, 0},
              fmt::format("{}; give the file as Shake&Tune wrote it", why));
}

Result<std::string> unpacked(std::string_view bytes, const std::string& file) {
  const std::unique_ptr<ZSTD_DStream, decltype(&ZSTD_freeDStream)> stream(ZSTD_createDStream(),
                                                                          &ZSTD_freeDStream);
  std::string text;
  std::vector<char> room(ZSTD_DStreamOutSize());
  ZSTD_inBuffer in{bytes.data(), bytes.size(), 0};
  std::size_t left = 1;
  while (in.pos < in.size || left != 0) {
    ZSTD_outBuffer out{room.data(), room.size(), 0};
    const std::size_t before = in.pos;
    left = ZSTD_decompressStream(stream.get(), &out, &in);
    if (ZSTD_isError(left) != 0U) {
      return broken(file, fmt::format("cannot be unpacked ({})", ZSTD_getErrorName(left)));
    }
    text.append(room.data(), out.pos);
    if (text.size() > kMostBytes) {
      return broken(file, "unpacks to more than 512 MB");
    }
    if (out.pos == 0 && in.pos == before) {
      return broken(file, "is broken off");
    }
  }
  return text;
}

std::optional<Row> row_of(const Json& sample) {
  constexpr std::size_t kColumns = 4;
  if (!sample.is_array() || sample.size() != kColumns) {
    return std::nullopt;
  }
  Row row;
  for (const Json& value : sample) {
    if (!value.is_number() || !std::isfinite(value.get<double>())) {
      return std::nullopt;
    }
    row.push_back(value.get<double>());
  }
  return row;
}

Result<DataSet> set_of(std::string_view line, const std::string& file) {
  constexpr std::size_t kFewest = 32;
  const Json json = Json::parse(line, nullptr, /*allow_exceptions=*/false);
  if (!json.is_object() || !json.contains("name") || !json["name"].is_string() ||
      !json.contains("samples") || !json["samples"].is_array()) {
    return broken(file, "has a line that is no measurement");
  }
  const std::string name = fmt::format("{} ({})", file, json["name"].get_ref<const std::string&>());
  std::vector<Row> rows;
  for (const Json& sample : json["samples"]) {
    std::optional<Row> row = row_of(sample);
    if (!row) {
      return broken(name, fmt::format("sample {} is not four numbers", rows.size() + 1));
    }
    rows.push_back(std::move(*row));
  }
  if (rows.size() < kFewest) {
    return fail(ErrorKind::input, {name, 0},
                fmt::format("has {} samples, too few to tell a resonance", rows.size()));
  }
  Result<DataSet> set = timed_set(name, rows);
  if (set) {
    // The measurement's own name tells the axis, whatever the file is called.
    const DataSet own = named_set(json["name"].get<std::string>());
    set->axis = own.axis ? own.axis : set->axis;
    set->is_diagonal = own.is_diagonal;
  }
  return set;
}

}  // namespace

bool is_stdata(std::string_view bytes) { return bytes.starts_with("\x28\xb5\x2f\xfd"); }

Result<std::vector<DataSet>> parse_stdata(std::string_view bytes, const std::string& file) {
  const Result<std::string> text = unpacked(bytes, file);
  if (!text) {
    return tl::unexpected(text.error());
  }
  std::vector<DataSet> sets;
  std::string_view rest = *text;
  while (!rest.empty()) {
    const std::size_t end = rest.find('\n');
    const std::string_view line = rest.substr(0, end);
    rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
    if (line.find_first_not_of(" \t\r") == std::string_view::npos) {
      continue;
    }
    Result<DataSet> set = set_of(line, file);
    if (!set) {
      return tl::unexpected(set.error());
    }
    sets.push_back(std::move(*set));
  }
  if (sets.empty()) {
    return broken(file, "holds no measurement");
  }
  return sets;
}

}  // namespace unflex::identify
