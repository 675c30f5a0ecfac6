#include "batch_manifest.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/file.h>

#include <cerrno>
#include <chrono>
#include <fstream>
#include <system_error>
#include <thread>
#include <utility>

#include "outputs.hpp"

namespace unflex::app {
namespace {

using report::Json;

constexpr int kSchemaVersion = 1;
// The processes of a batch that was killed need a moment to end.
constexpr int kClaims = 10;
constexpr std::chrono::milliseconds kBetweenClaims{100};

Status claim(int folder, const std::string& name) {
  for (int i = 0; ::flock(folder, LOCK_EX | LOCK_NB) != 0; ++i) {
    if (errno != EWOULDBLOCK && errno != EINTR) {
      // Network file systems may not know such claims; the manifest itself is safe without them.
      return {};
    }
    if (i == kClaims) {
      return fail(ErrorKind::usage, {name, 0},
                  "another unflex batch works in this folder; wait for it or give -o another");
    }
    std::this_thread::sleep_for(kBetweenClaims);
  }
  return {};
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

Result<BatchManifest> BatchManifest::open(const std::filesystem::path& folder) {
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  FileDescriptor claimed(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (failed || !claimed.valid()) {
    return fail(
        ErrorKind::usage, {folder.string(), 0},
        fmt::format("cannot make the folder: {}", failed ? failed.message() : errno_text(errno)));
  }
  if (Status free = claim(claimed.get(), folder.string()); !free) {
    return tl::unexpected(free.error());
  }
  BatchManifest manifest(folder / kManifestName, std::move(claimed));
  // Checks before the work begins that the manifest can be written.
  if (const Result<Output> probe = Output::open(manifest.file_.string()); !probe) {
    return tl::unexpected(probe.error());
  }
  manifest.read();
  return manifest;
}

void BatchManifest::read() {
  std::ifstream stream(file_, std::ios::binary);
  if (!stream) {
    return;
  }
  try {
    const Json json = Json::parse(stream);
    if (json.at("schema_version") != kSchemaVersion) {
      return;
    }
    for (const auto& [key, record] : json.at("prints").items()) {
      records_[key] = record_from(record);
    }
  } catch (const Json::exception&) {
    records_.clear();
  }
}

std::optional<BatchRecord> BatchManifest::find(const std::string& name) const {
  const auto found = records_.find(key_of(name));
  return found == records_.end() ? std::nullopt : std::optional(found->second);
}

Status BatchManifest::put(const std::string& name, const BatchRecord& record) {
  records_[key_of(name)] = record;
  Json prints = Json::object();
  for (const auto& [key, known] : records_) {
    prints[key] = to_json(known);
  }
  Result<Output> output = Output::open(file_.string());
  if (!output) {
    return fail(ErrorKind::internal, output.error().place, output.error().message);
  }
  return output->write(report::dump({{"schema_version", kSchemaVersion}, {"prints", prints}}))
      .and_then([&] { return output->commit(); });
}

}  // namespace unflex::app
