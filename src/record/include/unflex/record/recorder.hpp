// Gathers the data for a print's page while the print is verified, in bounded memory.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "unflex/dynamics/shapers.hpp"
#include "unflex/report/recording.hpp"
#include "unflex/verify/observer.hpp"
#include "unflex/verify/verify.hpp"

namespace unflex::record {

// The printer's own input shaper, built for the frequencies and dampings of its configuration. An
// axis without pulses is not shaped.
struct PrinterShaper {
  std::string name;
  Axes<dynamics::ShaperPulses> pulses;
};

struct Options {
  verify::NozzleModel nozzle;  // what the shapers are for: Rules::nozzle or a tool's
  std::optional<PrinterShaper> printer_shaper{};  // nullopt if it has none or none is known
  // Further shapers that the print is measured with.
  std::span<const dynamics::ShaperKind> shapers = dynamics::kShaperKinds;
  std::size_t paths_bytes = 1'500'000;
  std::size_t places = 12;  // number of worst places, for each of before and after
};

class Recorder {
 public:
  explicit Recorder(const Options& options);
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  // To watch one verification, which must also measure verify::detuned(). The recorder must outlive
  // the verification.
  [[nodiscard]] verify::Observer& observer();
  // The recording of the verification, whose result is `verified`. Call it once.
  [[nodiscard]] report::Recording finish(const verify::VerifyReport& verified);

 private:
  class Gatherer;
  Options options_;
  std::unique_ptr<Gatherer> gatherer_;
};

}  // namespace unflex::record
