// The inside of a Recorder.
//
// Two nozzles (before and after) go along the same moves, one ahead of the other. When both have
// left a move, its cells are complete and go to the layers.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "feature_log.hpp"
#include "layer_store.hpp"
#include "moment_ring.hpp"
#include "path_cells.hpp"
#include "shaper_bench.hpp"
#include "unflex/core/xy.hpp"
#include "unflex/record/recorder.hpp"
#include "unflex/verify/log_histogram.hpp"
#include "worst_places.hpp"

namespace unflex::record {

class Recorder::Gatherer final : public verify::Observer {
 public:
  // machines: number of machines, with different true frequencies, that shapers are measured on.
  Gatherer(const Options& options, std::size_t machines);

  void line(const gcode::Line& line) override;
  void section(const verify::ReferencePath& sliced, const verify::ReferencePath& emitted) override;
  void step(verify::NozzleId nozzle, const verify::NozzleStep& step) override;
  void hold(double duration_s) override;
  void advanced(const verify::ReferencePath& sliced, double time_s) override;
  [[nodiscard]] double memory_s() const override { return bench_.memory_s(); }
  [[nodiscard]] bool asks_for_unshaped() const override { return !bench_.is_empty(); }

  [[nodiscard]] report::Recording finish();

 private:
  // The deviation on a short bit of a move.
  struct Chunk {
    double from_mm = 0.0;
    double weight_s = 0.0;
    double sum_contour2 = 0.0;
    double contour2_max_mm2 = -1.0;
    XY max_at_mm;  // where the reference was at the largest deviation
    std::size_t max_line = 0;
  };
  // Data of a move that lays filament. Some filament may come out behind the move's end, in travel.
  struct Laid {
    std::size_t layer = 0;
    std::size_t feature = 0;
    double z_mm = 0.0;
  };
  // One of the two nozzles.
  struct Version {
    explicit Version(double half_width_s, std::size_t places) : ring(half_width_s), worst(places) {}

    const verify::ReferencePath* path = nullptr;
    std::size_t first_piece = 0;  // first piece of the section on `path`
    std::size_t piece = 0;        // the nozzle's piece on `path`
    PathPoint where;
    std::optional<Laid> laid;  // by the last move that lays filament
    Chunk chunk;
    double block_s = 0.0;
    PlaceCandidate block;  // worst of the last tenth of a second
    MomentRing ring;
    WorstPlaces worst;
    verify::LogHistogram histogram;
  };
  struct Sums {
    double contour2_max_mm2 = 0.0;
    double sum_contour2 = 0.0;
    double weight_s = 0.0;

    void add(const Chunk& chunk);
    [[nodiscard]] report::Spread spread() const;
  };
  struct Layer {
    double z_mm = 0.0;
    std::size_t first_line = 0;
    std::array<Sums, 2> sums;
  };
  // The motion of both nozzles around a place.
  struct Scene {
    std::size_t id = 0;
    std::array<std::vector<report::Moment>, 2> moments;
  };

  // Filament comes out.
  void lay(int number, const verify::NozzleStep& step);
  void move_along(Version& version, const verify::NozzleStep& step) const;
  void enter(int number, std::size_t piece);
  void leave_start();
  void close_chunk(int number, double to_mm);
  void append_moves(const Version& version, std::size_t until);
  [[nodiscard]] std::size_t layer_of(const verify::PathPiece& piece, std::size_t layers_begun);
  void complete_moves(std::size_t until);
  void propose(int number);
  void collect_moments(int number, bool over);
  [[nodiscard]] std::vector<report::Place> places(int number) const;
  [[nodiscard]] std::vector<report::HistogramCell> histogram() const;

  FeatureLog features_;
  std::vector<std::array<Sums, 2>> feature_sums_;
  std::vector<Layer> layers_;
  std::size_t layers_begun_ = 0;
  std::size_t start_layers_ = 0;  // layers before the first that the slicer names
  LayerStore store_;
  PathCells cells_;
  std::size_t section_first_ = 0;  // first move of the section
  std::array<Version, 2> versions_;
  std::vector<Scene> scenes_;
  std::size_t next_id_ = 0;
  ShaperBench bench_;
};

}  // namespace unflex::record
