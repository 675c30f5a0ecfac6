// Gathers what a page shows of a print while it is verified, in bounded memory.
#pragma once

#include <cstddef>
#include <memory>

#include "unflex/report/recording.hpp"
#include "unflex/verify/observer.hpp"
#include "unflex/verify/verify.hpp"

namespace unflex::record {

struct Options {
  verify::NozzleModel nozzle;  // of the verification's rules
  std::size_t paths_bytes = 1'500'000;
  std::size_t places = 12;  // worst ones, before and after each
};

class Recorder {
 public:
  explicit Recorder(const Options& options);
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  // Watches a verification that also measures verify::detuned(); once, and before the recorder
  // ends.
  [[nodiscard]] verify::Observer& observer();
  // Of the verification that came out so.
  [[nodiscard]] report::Recording finish(const verify::VerifyReport& verified);

 private:
  class Gatherer;
  Options options_;
  std::unique_ptr<Gatherer> gatherer_;
};

}  // namespace unflex::record
