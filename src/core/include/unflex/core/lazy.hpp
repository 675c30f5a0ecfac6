// A value that is seldom set.
#pragma once

#include <memory>

namespace unflex {

// Value{} until it is edited; until then it takes only the room of a pointer. Copies are
// independent.
template <class Value>
class Lazy {
 public:
  Lazy() = default;
  Lazy(const Lazy& other) : value_(other.copy()) {}
  Lazy(Lazy&&) noexcept = default;
  Lazy& operator=(const Lazy& other) {
    value_ = other.copy();
    return *this;
  }
  Lazy& operator=(Lazy&&) noexcept = default;
  ~Lazy() = default;

  [[nodiscard]] const Value& operator*() const { return value_ ? *value_ : unset(); }
  [[nodiscard]] const Value* operator->() const { return &**this; }

  [[nodiscard]] Value& edit() {
    if (!value_) {
      value_ = std::make_unique<Value>();
    }
    return *value_;
  }
  void reset() { value_.reset(); }

 private:
  [[nodiscard]] static const Value& unset() {
    static const Value value;
    return value;
  }
  [[nodiscard]] std::unique_ptr<Value> copy() const {
    return value_ ? std::make_unique<Value>(*value_) : nullptr;
  }

  std::unique_ptr<Value> value_;
};

}  // namespace unflex
