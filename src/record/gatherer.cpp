#include "gatherer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "unflex/core/math.hpp"

namespace unflex::record {
namespace {

// Deviations are kept for bits of the path of about this long.
constexpr double kChunk_s = 3e-3;
// One candidate for the worst places is taken in each block of this length.
constexpr double kBlock_s = 0.1;
// How many periods of the slower axis are shown before and after a place.
constexpr double kPeriods = 3.0;
constexpr double kShortest_s = 0.06;
constexpr double kLongest_s = 0.2;
constexpr std::size_t kMostLayers = 8192;
// If the slicer writes no comments, a layer begins when filament is laid at another height. While Z
// rises steadily, it begins after kSpiralLayer_mm.
constexpr double kSameZ_mm = 0.005;
constexpr double kSpiralLayer_mm = 0.2;
constexpr double kFinestCell_mm = 1e-5;
constexpr int kHistogramCells = 72;
constexpr double kCellsPerOctave = 4.0;
// Share of a scene, around its centre, that counts as being at the place.
constexpr double kAtPlace = 0.05;
constexpr std::size_t kNoPiece = std::numeric_limits<std::size_t>::max();

double half_width_s(const verify::NozzleModel& model) {
  const double slower = dynamics::slowest_rad_s(model);
  return std::clamp(kPeriods * 2.0 * std::numbers::pi / slower, kShortest_s, kLongest_s);
}

}  // namespace

void Recorder::Gatherer::Sums::add(const Chunk& chunk) {
  contour2_max_mm2 = std::max(contour2_max_mm2, chunk.contour2_max_mm2);
  sum_contour2 += chunk.sum_contour2;
  weight_s += chunk.weight_s;
}

report::Spread Recorder::Gatherer::Sums::spread() const {
  return {std::sqrt(contour2_max_mm2), weight_s > 0.0 ? std::sqrt(sum_contour2 / weight_s) : 0.0};
}

Recorder::Gatherer::Gatherer(const Options& options, std::size_t machines)
    : store_(options.paths_bytes),
      versions_{Version(half_width_s(options.nozzle), options.places),
                Version(half_width_s(options.nozzle), options.places)},
      bench_(options.nozzle, options.shapers, options.printer_shaper, machines) {}

void Recorder::Gatherer::line(const gcode::Line& line) {
  features_.read(line.content(), line.number);
}

void Recorder::Gatherer::section(const verify::ReferencePath& sliced,
                                 const verify::ReferencePath& emitted) {
  // Under the printer's own shaper a nozzle may still be in the section before. Then it goes on in
  // that section, by the numbers of the sliced file's path.
  std::size_t needed = sliced.end();
  for (int number : {0, 1}) {
    Version& version = versions_[number];
    const verify::ReferencePath* const path = number == 0 ? &sliced : &emitted;
    if (path == version.path && path == &sliced && version.piece != kNoPiece) {
      needed = std::min(needed, version.where.move);
    } else {
      close_chunk(number, std::numeric_limits<double>::infinity());
      version.piece = kNoPiece;
    }
    version.path = path;
    version.first_piece = path->end();
  }
  section_first_ = sliced.end();
  // Moves of filament alone were never entered, so cells_ may end too early.
  versions_[0].path = &sliced;
  if (cells_.first() < cells_.end()) {
    append_moves(versions_[0], section_first_ - 1);
  }
  complete_moves(std::min(needed, cells_.end()));
  if (cells_.first() == cells_.end()) {
    cells_.continue_at(section_first_);
  }
}

void Recorder::Gatherer::step(verify::NozzleId nozzle, const verify::NozzleStep& step) {
  using verify::NozzleBase;
  const bool is_drawn = nozzle.model <= verify::kFrequencyErrors.size();
  if (is_drawn && (nozzle.base == NozzleBase::sliced || nozzle.base == NozzleBase::unshaped)) {
    bench_.add(nozzle.model, step.time_s, step.nozzle);
  }
  if (nozzle.model != 0 || nozzle.base == NozzleBase::unshaped) {
    return;
  }
  const int number = nozzle.base == NozzleBase::emitted ? 1 : 0;
  Version& version = versions_[number];
  if (step.extruding) {
    version.histogram.add_square(step.mean_contour2_mm2, step.h_s);
  }
  if (step.measured && step.piece != version.piece) {
    close_chunk(number, std::numeric_limits<double>::infinity());
    enter(number, step.piece);
  }
  if (step.extruding && version.piece != kNoPiece) {
    lay(number, step);
  }
  if (!step.waiting && version.ring.advance(step.h_s)) {
    if (step.measured) {
      move_along(version, step);
    }
    version.ring.add(step, version.where);
    if (version.ring.has_requests()) {
      collect_moments(number, false);
    }
  }
}

void Recorder::Gatherer::move_along(Version& version, const verify::NozzleStep& step) const {
  const double along_mm = cells_[version.where.move].along_mm(step.reference_mm);
  version.where.along_mm = std::max(version.where.along_mm, along_mm);
}

void Recorder::Gatherer::lay(int number, const verify::NozzleStep& step) {
  Version& version = versions_[number];
  Chunk& chunk = version.chunk;
  chunk.weight_s += step.h_s;
  chunk.sum_contour2 += step.h_s * step.mean_contour2_mm2;
  if (step.largest_contour2_mm2 > chunk.contour2_max_mm2) {
    chunk.contour2_max_mm2 = step.largest_contour2_mm2;
    chunk.max_at_mm = step.measured ? step.reference_mm : dynamics::place_mm(step.nozzle);
    chunk.max_line = step.line;
  }
  if (step.measured && chunk.weight_s >= kChunk_s) {
    move_along(version, step);
    close_chunk(number, version.where.along_mm);
    version.chunk.from_mm = version.where.along_mm;
  }
}

// The nozzle's reference comes to another piece of its path.
void Recorder::Gatherer::enter(int number, std::size_t piece) {
  Version& version = versions_[number];
  version.piece = piece;
  const std::size_t move = section_first_ + (piece - version.first_piece);
  append_moves(version, move);
  version.where = {move, 0.0};
  version.chunk.from_mm = 0.0;
  if (const PathMove& entered = cells_[move]; entered.extruding) {
    version.laid = {entered.layer, entered.feature, entered.z_mm};
  }
  complete_moves(std::min(versions_[0].where.move, versions_[1].where.move));
}

void Recorder::Gatherer::append_moves(const Version& version, std::size_t until) {
  while (cells_.end() <= until) {
    const std::size_t piece = version.first_piece + (cells_.end() - section_first_);
    const verify::PathPiece& added = (*version.path)[std::max(piece, version.path->first())];
    const FeatureLog::At at = features_.at(added.move.segment.line);
    const std::size_t layer = added.extruding ? layer_of(added, at.layers_begun) : layers_.size();
    cells_.append(added, layer, at.feature);
  }
}

std::size_t Recorder::Gatherer::layer_of(const verify::PathPiece& piece, std::size_t layers_begun) {
  const gcode::Segment& segment = piece.move.segment;
  const double z_mm = segment.end_mm[gcode::Z];
  bool begins = layers_.empty();
  if (!begins) {
    const double rise_mm = std::abs(z_mm - layers_.back().z_mm);
    const bool level = segment.delta(gcode::Z) == 0.0;
    begins = layers_begun > 0 ? layers_begun != layers_begun_
                              : rise_mm > (level ? kSameZ_mm : kSpiralLayer_mm);
  }
  if (layers_begun > 0 && layers_begun_ == 0) {
    leave_start();
  }
  if (begins && layers_.size() < kMostLayers) {
    layers_.push_back({z_mm, segment.line, {}});
  }
  layers_begun_ = layers_begun;
  return layers_.size() - 1;
}

// Lines before the first layer prime the nozzle and are not part of the print.
void Recorder::Gatherer::leave_start() {
  start_layers_ = layers_.size();
  for (Version& version : versions_) {
    version.worst.clear();
    for (const Scene& scene : scenes_) {
      version.ring.cancel(scene.id);
    }
  }
  scenes_.clear();
}

void Recorder::Gatherer::close_chunk(int number, double to_mm) {
  Version& version = versions_[number];
  if (version.chunk.contour2_max_mm2 < 0.0 || !version.laid) {
    return;  // filament that comes out before the first line belongs to that line
  }
  const Chunk chunk = std::exchange(version.chunk, Chunk{});
  const PathMove& move = cells_[version.where.move];
  if (move.extruding) {
    cells_.deviate(version.where.move, number, chunk.from_mm, std::min(to_mm, move.length_mm),
                   report::deviation_code(chunk.contour2_max_mm2));
  }
  const Laid& laid = *version.laid;
  layers_[laid.layer].sums[number].add(chunk);
  if (feature_sums_.size() <= laid.feature) {
    feature_sums_.resize(laid.feature + 1);
  }
  feature_sums_[laid.feature][number].add(chunk);

  if (chunk.contour2_max_mm2 > version.block.contour2_mm2) {
    const double along_mm = move.along_mm(chunk.max_at_mm);
    version.block = {chunk.contour2_max_mm2,
                     {version.where.move, along_mm},
                     chunk.max_line,
                     laid.layer,
                     laid.feature,
                     chunk.max_at_mm,
                     laid.z_mm};
  }
  version.block_s += chunk.weight_s;
  if (version.block_s >= kBlock_s) {
    propose(number);
  }
}

// Proposes the worst of the last kBlock_s for the worst places.
void Recorder::Gatherer::propose(int number) {
  Version& version = versions_[number];
  const PlaceCandidate candidate = std::exchange(version.block, {});
  version.block_s = 0.0;
  if (candidate.contour2_mm2 <= 0.0 || candidate.layer < start_layers_) {
    return;
  }
  const std::size_t id = next_id_++;
  const WorstPlaces::Change change = version.worst.add(candidate, id);
  for (const std::size_t removed : change.removed) {
    std::erase_if(scenes_, [&](const Scene& scene) { return scene.id == removed; });
    for (Version& each : versions_) {
      each.ring.cancel(removed);
    }
  }
  if (change.added) {
    scenes_.push_back({id, {}});
    for (Version& each : versions_) {
      each.ring.request(id, candidate.where);
    }
  }
}

void Recorder::Gatherer::collect_moments(int number, bool over) {
  for (MomentRing::Taken& taken : versions_[number].ring.take(over)) {
    const auto scene = std::find_if(scenes_.begin(), scenes_.end(),
                                    [&](const Scene& each) { return each.id == taken.id; });
    if (scene != scenes_.end()) {
      scene->moments[number] = std::move(taken.moments);
    }
  }
}

// Stores the moves before `until`, which both nozzles have left.
void Recorder::Gatherer::complete_moves(std::size_t until) {
  while (cells_.first() < until) {
    const PathMove& move = cells_[cells_.first()];
    for (std::size_t i = 0; i < move.cells; ++i) {
      const auto place = [&](std::size_t border) {
        return move.length_mm * static_cast<double>(border) / static_cast<double>(move.cells);
      };
      const double from_mm = place(i);
      const double to_mm = place(i + 1);
      const std::array<unsigned char, 2> codes = cells_.cell(move, i);
      store_.add({move.layer, move.feature, move.line, move.start_mm + from_mm * move.direction,
                  move.start_mm + to_mm * move.direction, codes[0], codes[1]});
    }
    cells_.drop_front();
  }
}

void Recorder::Gatherer::hold(double duration_s) {
  for (Version& version : versions_) {
    version.ring.pass(duration_s);
  }
}

void Recorder::Gatherer::advanced(const verify::ReferencePath& sliced, double time_s) {
  bench_.advance(sliced, time_s);
}

std::vector<report::Place> Recorder::Gatherer::places(int number) const {
  std::vector<report::Place> result;
  for (const WorstPlaces::Kept& kept : versions_[number].worst.places()) {
    const PlaceCandidate& candidate = kept.candidate;
    report::Place place;
    place.line = candidate.line;
    place.layer = candidate.layer;
    place.feature = candidate.feature;
    place.xy_mm = candidate.xy_mm;
    place.z_mm = candidate.z_mm;
    for (const Scene& scene : scenes_) {
      if (scene.id == kept.id) {
        place.before = scene.moments[0];
        place.after = scene.moments[1];
      }
    }
    const auto largest = [](const std::vector<report::Moment>& moments) {
      double most = 0.0;
      for (const report::Moment& moment : moments) {
        const double reach_s = kAtPlace * moments.back().time_s;
        most = std::abs(moment.time_s) <= reach_s ? std::max(most, moment.contour_mm) : most;
      }
      return most;
    };
    place.before_mm = largest(place.before);
    place.after_mm = largest(place.after);
    (number == 0 ? place.before_mm : place.after_mm) = std::sqrt(candidate.contour2_mm2);
    for (std::vector<report::Moment>* moments : {&place.before, &place.after}) {
      for (report::Moment& moment : *moments) {
        for (XY* at_mm : {&moment.reference_mm, &moment.base_mm, &moment.nozzle_mm}) {
          *at_mm = *at_mm - place.xy_mm;
        }
      }
    }
    result.push_back(std::move(place));
  }
  return result;
}

std::vector<report::HistogramCell> Recorder::Gatherer::histogram() const {
  std::vector<report::HistogramCell> result;
  double before_s = 0.0;
  double after_s = 0.0;
  for (int cell = 0; cell < kHistogramCells; ++cell) {
    const double to_mm = cell + 1 < kHistogramCells
                             ? kFinestCell_mm * math::exp2((cell + 1) / kCellsPerOctave)
                             : std::numeric_limits<double>::infinity();
    const double before_to_s = versions_[0].histogram.weight_below(to_mm);
    const double after_to_s = versions_[1].histogram.weight_below(to_mm);
    result.push_back({cell == 0 ? 0.0 : kFinestCell_mm * math::exp2(cell / kCellsPerOctave),
                      before_to_s - before_s, after_to_s - after_s});
    before_s = before_to_s;
    after_s = after_to_s;
  }
  return result;
}

report::Recording Recorder::Gatherer::finish() {
  for (int number : {0, 1}) {
    close_chunk(number, std::numeric_limits<double>::infinity());
    propose(number);
  }
  for (int number : {0, 1}) {
    collect_moments(number, true);
  }
  complete_moves(cells_.end());

  report::Recording recording;
  std::vector<std::size_t> ends;
  recording.start_layers = start_layers_;
  recording.paths = store_.encode(layers_.size(), ends);
  for (std::size_t i = 0; i < layers_.size(); ++i) {
    recording.layers.push_back({layers_[i].z_mm,
                                layers_[i].first_line,
                                {layers_[i].sums[0].spread(), layers_[i].sums[1].spread()},
                                ends[i]});
  }
  feature_sums_.resize(features_.names().size());
  for (std::size_t i = 0; i < feature_sums_.size(); ++i) {
    recording.features.push_back({features_.names()[i],
                                  feature_sums_[i][0].weight_s,
                                  {feature_sums_[i][0].spread(), feature_sums_[i][1].spread()}});
  }
  recording.worst_before = places(0);
  recording.worst_after = places(1);
  recording.histogram = histogram();
  recording.contenders = bench_.contenders();
  recording.shapers_measured_s = bench_.measured_s();
  return recording;
}

}  // namespace unflex::record
