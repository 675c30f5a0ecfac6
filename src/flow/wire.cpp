#include "wire.hpp"

#include <cstring>
#include <type_traits>
#include <vector>

namespace unflex::flow {
namespace {

class Writer {
 public:
  template <class T>
  void value(const T& item) {
    static_assert(std::is_trivially_copyable_v<T>);
    bytes_.append(reinterpret_cast<const char*>(&item), sizeof item);
  }
  void values(const std::vector<double>& items) {
    value(items.size());
    bytes_.append(reinterpret_cast<const char*>(items.data()), items.size() * sizeof(double));
  }
  void text(std::string_view item) {
    value(item.size());
    bytes_.append(item);
  }
  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

// Reads what a Writer of the same program wrote, so lengths are as they should be.
class Reader {
 public:
  explicit Reader(std::string_view bytes) : bytes_(bytes) {}

  template <class T>
  T value() {
    static_assert(std::is_trivially_copyable_v<T>);
    T item;
    std::memcpy(&item, bytes_.data(), sizeof item);
    bytes_.remove_prefix(sizeof item);
    return item;
  }
  std::vector<double> values() {
    std::vector<double> items(value<std::size_t>());
    const std::size_t size = items.size() * sizeof(double);
    if (size > 0) {
      std::memcpy(items.data(), bytes_.data(), size);
    }
    bytes_.remove_prefix(size);
    return items;
  }
  std::string text() {
    const auto size = value<std::size_t>();
    std::string item(bytes_.substr(0, size));
    bytes_.remove_prefix(size);
    return item;
  }

 private:
  std::string_view bytes_;
};

}  // namespace

std::string pack(const compensate::AxisWindow& window) {
  Writer writer;
  writer.value(window.axis);
  writer.value(window.plants.size());
  for (const compensate::Plant& plant : window.plants) {
    writer.value(plant);
  }
  writer.value(window.period_s);
  writer.values(window.reference_mm);
  writer.values(window.weight);
  writer.values(window.freq_shares);
  writer.value(window.aims_mm.size());
  for (const std::vector<double>& aim_mm : window.aims_mm) {
    writer.values(aim_mm);
  }
  writer.value(window.jerk_weight);
  writer.value(window.limits);
  writer.values(window.max_velocity_at_mm_s);
  writer.values(window.max_accel_at_mm_s2);
  writer.value(window.start);
  writer.value(window.end_base_mm);
  return writer.take();
}

compensate::AxisWindow unpack_window(std::string_view bytes) {
  Reader reader(bytes);
  compensate::AxisWindow window;
  window.axis = reader.value<dynamics::FlexibleAxis>();
  window.plants.resize(reader.value<std::size_t>());
  for (compensate::Plant& plant : window.plants) {
    plant = reader.value<compensate::Plant>();
  }
  window.period_s = reader.value<double>();
  window.reference_mm = reader.values();
  window.weight = reader.values();
  window.freq_shares = reader.values();
  window.aims_mm.resize(reader.value<std::size_t>());
  for (std::vector<double>& aim_mm : window.aims_mm) {
    aim_mm = reader.values();
  }
  window.jerk_weight = reader.value<double>();
  window.limits = reader.value<compensate::BaseLimits>();
  window.max_velocity_at_mm_s = reader.values();
  window.max_accel_at_mm_s2 = reader.values();
  window.start = reader.value<std::optional<compensate::AxisWindow::Start>>();
  window.end_base_mm = reader.value<std::optional<double>>();
  return window;
}

std::string pack(const Result<compensate::AxisSolution>& solution) {
  Writer writer;
  writer.value(solution.has_value());
  if (solution) {
    writer.values(solution->base.position_mm);
    writer.values(solution->base.velocity_mm_s);
    writer.values(solution->base.accel_mm_s2);
    writer.value(solution->objective);
    writer.value(solution->iterations);
  } else {
    writer.text(solution.error().message);
  }
  return writer.take();
}

Result<compensate::AxisSolution> unpack_solution(std::string_view bytes) {
  Reader reader(bytes);
  if (!reader.value<bool>()) {
    return fail(ErrorKind::internal, reader.text());
  }
  compensate::AxisSolution solution;
  solution.base.position_mm = reader.values();
  solution.base.velocity_mm_s = reader.values();
  solution.base.accel_mm_s2 = reader.values();
  solution.objective = reader.value<double>();
  solution.iterations = reader.value<int>();
  return solution;
}

}  // namespace unflex::flow
