#include "batch_manifest.hpp"

#include <fmt/core.h>

#include <cerrno>
#include <chrono>
#include <istream>
#include <memory>
#include <utility>

#include "outputs.hpp"
#include "unflex/core/errno_text.hpp"
#include "unflex/core/threads.hpp"
#include "unflex/platform/files.hpp"
#include "unflex/platform/folders.hpp"
#include "unflex/platform/names.hpp"
#include "unflex/platform/replacing.hpp"

namespace unflex::app {
namespace {

using report::Json;

constexpr std::string_view kBeginning = ".unflex-batch.";
constexpr std::string_view kEnding = "json";
constexpr int kSchemaVersion = 1;
// The processes of a batch that was killed need a moment to end.
constexpr int kClaims = 10;
constexpr std::chrono::milliseconds kBetweenClaims{100};

Result<FileDescriptor> claim(const std::string& folder, platform::Claim kind) {
  for (int i = 0;; ++i) {
    tl::expected<FileDescriptor, int> claimed = platform::claim_folder(folder, kind);
    if (claimed) {
      return std::move(*claimed);
    }
    if (claimed.error() != EWOULDBLOCK) {
      return fail(ErrorKind::usage, {folder, 0},
                  fmt::format("cannot make the folder: {}", errno_text(claimed.error())));
    }
    if (i == kClaims) {
      return fail(ErrorKind::usage, {folder, 0},
                  "another unflex batch works in this folder; wait for it or give -o another");
    }
    sleep_for(kBetweenClaims);
  }
}

}  // namespace

std::string key_of(std::string_view name) {
  std::string key;
  for (const char c : name) {
    if (c > ' ' && c < '\x7f' && c != '%') {
      key += c;
    } else {
      key += fmt::format("%{:02X}", static_cast<unsigned char>(c));
    }
  }
  return key;
}

std::string manifest_name(const std::optional<Shard>& shard) {
  return shard ? fmt::format("{}{}-of-{}.{}", kBeginning, shard->number, shard->count, kEnding)
               : std::string(kManifestName);
}

Result<BatchManifest> BatchManifest::open(const std::string& folder,
                                          const std::optional<Shard>& shard) {
  if (const int error = platform::make_folders(folder); error != 0) {
    return fail(ErrorKind::usage, {folder, 0},
                fmt::format("cannot make the folder: {}", errno_text(error)));
  }
  Result<FileDescriptor> claimed =
      claim(folder, shard ? platform::Claim::with_others : platform::Claim::alone);
  if (!claimed) {
    return tl::unexpected(claimed.error());
  }
  BatchManifest manifest(platform::joined(folder, manifest_name(shard)), std::move(*claimed));
  // Checks before the work begins that the manifest can be written.
  if (const Result<Output> probe = Output::open(manifest.file_); !probe) {
    return tl::unexpected(probe.error());
  }
  manifest.read(manifest.file_, true);
  for (const platform::FolderEntry& entry :
       platform::entries_of(folder).value_or(std::vector<platform::FolderEntry>{})) {
    const std::string file = platform::joined(folder, entry.name);
    if (entry.name.starts_with(kBeginning) && entry.name.ends_with(kEnding) &&
        file != manifest.file_) {
      manifest.read(file, false);
    }
  }
  return manifest;
}

void BatchManifest::read(const std::string& file, bool is_own) {
  const std::unique_ptr<std::istream> stream = platform::read_file(file);
  if (!*stream) {
    return;
  }
  const Json json = Json::parse(*stream, nullptr, false);
  if (!json.is_object() || json.value("schema_version", Json()) != kSchemaVersion) {
    return;
  }
  const Json prints = json.value("prints", Json::object());
  std::map<std::string, BatchRecord> records;
  for (const auto& [key, value] : prints.items()) {
    const std::optional<BatchRecord> record = record_from(value);
    if (!record) {
      return;
    }
    records[key] = *record;
  }
  if (is_own) {
    records_ = std::move(records);
  } else {
    records_of_others_.insert(records.begin(), records.end());
  }
}

std::vector<BatchRecord> BatchManifest::find(const std::string& name) const {
  std::vector<BatchRecord> found;
  const std::string key = key_of(name);
  if (const auto own = records_.find(key); own != records_.end()) {
    found.push_back(own->second);
  }
  const auto [begin, end] = records_of_others_.equal_range(key);
  for (auto other = begin; other != end; ++other) {
    found.push_back(other->second);
  }
  return found;
}

Status BatchManifest::put(const std::string& name, const BatchRecord& record) {
  records_[key_of(name)] = record;
  Json prints = Json::object();
  for (const auto& [key, known] : records_) {
    prints[key] = to_json(known);
  }
  Result<Output> output = Output::open(file_);
  if (!output) {
    return fail(ErrorKind::internal, output.error().place, output.error().message);
  }
  return output->write(report::dump({{"schema_version", kSchemaVersion}, {"prints", prints}}))
      .and_then([&] { return output->commit(); });
}

}  // namespace unflex::app
