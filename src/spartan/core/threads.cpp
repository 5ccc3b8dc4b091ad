#include "spartan/core/threads.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <opencv2/core/utility.hpp>
#include <stdexcept>

namespace spartan {

struct Workers::Arena {
  explicit Arena(int threads) : tasks(threads) {}
  tbb::task_arena tasks;
};

Workers::Workers(int threads) : threads_(threads) {
  if (threads < 1) throw std::invalid_argument("Workers: at least one thread is needed");
  if (threads > 1) arena_ = std::make_shared<Arena>(threads);
}

void Workers::for_each_part(int begin, int end, int grain, const std::function<void(int, int)>& body) const {
  if (grain < 1) throw std::invalid_argument("Workers: the grain must be at least 1");
  if (end <= begin) return;
  const int parts = (end - begin + grain - 1) / grain;
  const auto run_part = [&](int part) {
    const int from = begin + part * grain;
    body(from, std::min(end, from + grain));
  };
  if (!arena_ || parts == 1) {
    for (int part = 0; part < parts; ++part) run_part(part);
    return;
  }
  arena_->tasks.execute([&] { tbb::parallel_for(0, parts, 1, run_part, tbb::simple_partitioner{}); });
}

void Workers::run_both(const std::function<void()>& first, const std::function<void()>& second) const {
  if (!arena_) {
    first();
    second();
    return;
  }
  arena_->tasks.execute([&] { tbb::parallel_invoke(first, second); });
}

void bound_third_party_threads(int threads) {
  cv::setNumThreads(threads);
}

}  // namespace spartan
