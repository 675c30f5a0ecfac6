// Where the library is built without Ipopt, no engine needs a process of its own.
#include <utility>

#include "worker_pool.hpp"

namespace unflex::flow {

WorkerPool::WorkerPool(EngineFactory factory) : factory_(std::move(factory)) {}

WorkerPool::~WorkerPool() = default;

Result<WorkerPool> WorkerPool::start(unsigned workers, const EngineFactory& factory) {
  if (workers > 0) {
    return fail(ErrorKind::internal, "there are no solver processes in this build");
  }
  return WorkerPool(factory);
}

void WorkerPool::submit(std::size_t /*ticket*/, const compensate::AxisWindow& /*window*/) {}

std::optional<WorkerPool::Done> WorkerPool::take(int /*timeout_ms*/) { return std::nullopt; }

}  // namespace unflex::flow
