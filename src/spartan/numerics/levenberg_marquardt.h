// The Levenberg-Marquardt loop: damping, acceptance of steps, stopping. The caller supplies cost and normal equations.
// Sources: Levenberg, Quart. Appl. Math. 2 (1944); Marquardt, SIAM J. Appl. Math. 11 (1963): the damping scales with
// the diagonal of the normal matrix, which makes the steps independent of the units of the parameters.
#pragma once

#include <algorithm>
#include <limits>
#include <utility>

namespace spartan {

/// Gauss-Newton approximation of a cost C at one state: the step δ = information⁻¹ gradient reduces C. For weighted
/// residuals r with Jacobian J, information = Σ JᵀWJ and gradient = −Σ JᵀWr.
template <class Matrix, class Vector>
struct NormalEquations {
  double cost = 0;
  Matrix information;
  Vector gradient;
};

enum class StepRule {
  decrease,      ///< a step is accepted where it lowers the cost
  not_increase,  ///< a step is also accepted where the cost stays equal (and then ends the search)
};

struct LevenbergMarquardtOptions {
  int max_trials = std::numeric_limits<int>::max();              ///< evaluated steps, accepted or not
  int max_steps = std::numeric_limits<int>::max();               ///< accepted steps
  int max_rejections = std::numeric_limits<int>::max();          ///< rejected steps in a row
  double initial_damping = 1e-4;                                 ///< relative to the diagonal of the information matrix
  double min_damping = 0;                                        ///< lower bound after accepted steps
  double min_rejected_damping = 0;                               ///< lower bound after rejected steps
  double max_damping = std::numeric_limits<double>::infinity();  ///< the search ends above it
  double relative_decrease = 1e-9;  ///< the search ends where a step lowers the cost by at most this fraction
  StepRule step_rule = StepRule::decrease;
};

/// Minimizes a cost from `state` on and returns the best state.
///   linearize(state) → NormalEquations, once at the start and once after each accepted step that does not end the
///     search;
///   cost(state) → double, once for each trial; a cost that is not a number rejects the step;
///   moved(state, step) → the state changed by a step.
/// When linearize() is called after an accepted step, its argument is that of the latest call of cost(), so a caller
/// whose residuals and Jacobians are computed together may keep them. Damping falls tenfold after an accepted step and
/// rises tenfold after a rejected one.
template <class State, class Linearize, class Cost, class Moved>
State minimize_levenberg_marquardt(State state, const LevenbergMarquardtOptions& options, Linearize linearize,
                                   Cost cost, Moved moved) {
  double damping = options.initial_damping;
  int steps = 0, rejections = 0;
  if (options.max_steps <= 0) return state;
  auto here = linearize(state);
  for (int trial = 0; trial < options.max_trials; ++trial) {
    auto damped = here.information;
    damped.diagonal() *= 1 + damping;
    const auto step = damped.ldlt().solve(here.gradient).eval();
    if (!step.allFinite()) break;
    State tried = moved(state, step);
    const double there = cost(tried);
    const bool accepted = options.step_rule == StepRule::decrease ? there < here.cost : there <= here.cost;
    if (!accepted) {
      damping = std::max(damping * 10, options.min_rejected_damping);
      if (damping > options.max_damping || ++rejections >= options.max_rejections) break;
      continue;
    }
    const double decrease = here.cost - there;
    state = std::move(tried);
    damping = std::max(damping * 0.1, options.min_damping);
    rejections = 0;
    if (decrease <= options.relative_decrease * there || ++steps >= options.max_steps) break;
    here = linearize(state);
  }
  return state;
}

}  // namespace spartan
