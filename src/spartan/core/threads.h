// How many threads the library may use: a value that is handed to the stages.
#pragma once

#include <functional>
#include <memory>

namespace spartan {

/// A bounded set of workers. Copies share them. Made once by whoever builds the pipeline.
class Workers {
 public:
  /// `threads` ≥ 1; the calling thread counts as one of them.
  explicit Workers(int threads = 1);

  int threads() const { return threads_; }
  /// Runs body(begin, end) over disjoint parts of [begin, end), each `grain` long (the last may be shorter).
  /// The parts depend on `grain` alone, never on the number of threads, so results can be made the same
  /// for any number. Returns when all are done; an exception of a part is thrown again here.
  void for_each_part(int begin, int end, int grain, const std::function<void(int, int)>& body) const;
  /// Runs the two at once where there are threads, else one after the other.
  void run_both(const std::function<void()>& first, const std::function<void()>& second) const;

 private:
  struct Arena;
  int threads_ = 1;
  std::shared_ptr<Arena> arena_;
};

/// Bounds the threads of third-party libraries (OpenCV) for the whole process; called once by the program.
void bound_third_party_threads(int threads);

}  // namespace spartan
