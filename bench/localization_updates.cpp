// Speed and allocations of the localization: `make bench-localization_updates`.
//
//   localization_updates [--config FOLDER] [--repeat N] [SCENARIO...]
//
// Feeds the samples of a simulated drive in order, on one thread, without asking for estimates; then once with an
// estimate at every frame. An update is one sample of any sensor.
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <new>
#include <stdexcept>

#include "localization_trial.h"
#include "standard_recordings.h"

namespace {
std::atomic<long> allocations{0};
}

[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void* operator new(std::size_t size, std::align_val_t alignment) {
  ++allocations;
  const auto a = static_cast<std::size_t>(alignment);
  if (void* memory = std::aligned_alloc(a, (size + a - 1) / a * a)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::align_val_t) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  std::free(memory);
}

namespace spartan {
namespace {

struct Pass {
  double updates_per_s = 0, allocations_per_update = 0;
};

std::vector<RelativeMotion> exact_motions(const TrueDrive& drive, std::uint64_t /*seed*/) {
  constexpr double kSigma = 3e-5;
  std::vector<RelativeMotion> motions;
  motions.reserve(drive.poses.size());
  for (std::size_t i = 1; i < drive.poses.size(); ++i) {
    motions.push_back({sim::internal::stamp_at(drive.frames_s[i - 1]), sim::internal::stamp_at(drive.frames_s[i]),
                       drive.poses[i - 1].inverse() * drive.poses[i], kSigma * kSigma * Matrix6d::Identity()});
  }
  return motions;
}

Pass feed(const TrueDrive& drive, const std::vector<Arrival>& all, bool estimates) {
  Localizer localizer = Localizer::create(options_for(drive)).value();
  const Stamp start = sim::internal::stamp_at(drive.frames_s.front());
  std::size_t first = 0;
  for (; first < all.size() && all[first].at_ns <= start.ns; ++first) localizer.add(all[first].measurement);
  localizer.start(start, Eigen::Vector3d::UnitX());
  const long before = allocations;
  const auto begin = std::chrono::steady_clock::now();
  double sum = 0;
  for (std::size_t i = first; i < all.size(); ++i) {
    localizer.add(all[i].measurement);
    if (estimates && std::holds_alternative<RelativeMotion>(all[i].measurement))
      sum += localizer.estimate().world_from_body.pose.translation().x();
  }
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
  if (!std::isfinite(sum + localizer.estimate().world_from_body.pose.translation().x()))
    throw std::runtime_error("the estimate is not finite");
  const auto updates = static_cast<double>(all.size() - first);
  return {updates / seconds.count(), static_cast<double>(allocations - before) / updates};
}

void run(const std::vector<std::string>& words) {
  RecordingArguments arguments = read_arguments(words, {{"--config", "config"}, {"--repeat", "9"}});
  if (arguments.scenarios.empty()) arguments.scenarios = {"rocky_20pct"};
  fmt::print(
      "| drive | updates | updates a second, median | allocations an update | with an estimate at each frame |\n");
  fmt::print("|---|---|---|---|---|\n");
  for (const std::string& name : arguments.scenarios) {
    auto drive = open_true_drive(arguments.options.at("--config"), name);
    if (!drive)
      throw std::runtime_error(fmt::format("{}: no such scenario in {}", name, arguments.options.at("--config")));
    drive->odometry = exact_motions;
    const auto all = arrivals(draw(*drive, {}, drive->scenario.compass, 1), Subset::of(15));
    std::vector<double> plain, with_estimates;
    double allocated = 0;
    for (int i = 0; i < arguments.number("--repeat"); ++i) {
      const Pass pass = feed(*drive, all, false);
      plain.push_back(pass.updates_per_s);
      allocated = pass.allocations_per_update;
      with_estimates.push_back(feed(*drive, all, true).updates_per_s);
    }
    std::sort(plain.begin(), plain.end());
    std::sort(with_estimates.begin(), with_estimates.end());
    fmt::print("| {} | {} | {:.0f} | {:.4f} | {:.0f} |\n", name, all.size(), plain[plain.size() / 2], allocated,
               with_estimates[with_estimates.size() / 2]);
  }
}

}  // namespace
}  // namespace spartan

int main(int argc, char** argv) {
  return spartan::run_benchmark(argc, argv, spartan::run);
}
