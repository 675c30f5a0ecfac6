// compensate_file IN OUT PRINTER: what `unflex compensate IN -o OUT --printer PRINTER` writes.
#include <cstdio>

#include "unflex/flow/flow.hpp"
#include "unflex/machine/machine.hpp"
#include "unflex/platform/files.hpp"

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fputs("usage: compensate_file IN OUT PRINTER\n", stderr);
    return 1;
  }
  unflex::SilentProgress progress;
  const auto sliced = unflex::platform::file_store(argv[1]);
  const auto report =
      unflex::machine::read_print_text(*sliced, argv[1])
          .and_then([&](const unflex::machine::PrintText& print) {
            return unflex::machine::load({.print = &print, .printer_file = argv[3]});
          })
          .and_then([&](const unflex::machine::Settings& settings) {
            return unflex::flow::compensate({.input = sliced,
                                             .input_name = argv[1],
                                             .output = unflex::platform::file_store(argv[2]),
                                             .output_name = argv[2],
                                             .settings = settings},
                                            progress);
          });
  std::puts(report ? unflex::report::to_text(*report).c_str()
                   : unflex::to_string(report.error()).c_str());
  return report && report->violation_count == 0 ? 0 : 2;
}
