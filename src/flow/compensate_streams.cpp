#include <iterator>
#include <memory>
#include <string>
#include <utility>

#include "unflex/unflex.hpp"

namespace unflex::flow {
namespace {

constexpr const char* kInputName = "the sliced print";
constexpr const char* kOutputName = "the output";

}  // namespace

Result<report::Report> compensate(std::istream& sliced, std::ostream& output,
                                  const machine::Settings& settings) {
  if (const Status valid = settings.validate(); !valid) {
    return tl::unexpected(valid.error());
  }
  std::string text{std::istreambuf_iterator<char>(sliced), {}};
  if (sliced.bad()) {
    return fail(ErrorKind::input, {kInputName, 0}, "cannot be read");
  }
  const std::shared_ptr<TextStore> written = memory_store();
  SilentProgress progress;
  Result<report::Report> report = compensate(Job{.input = memory_store(std::move(text)),
                                                 .input_name = kInputName,
                                                 .output = written,
                                                 .output_name = kOutputName,
                                                 .settings = settings},
                                             progress);
  if (!report) {
    return report;
  }
  output << written->read()->rdbuf() << std::flush;
  if (!output) {
    return fail(ErrorKind::internal, {kOutputName, 0}, "cannot be written");
  }
  return report;
}

}  // namespace unflex::flow
