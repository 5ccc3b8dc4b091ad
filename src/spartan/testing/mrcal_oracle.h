// The camera models of mrcal, as reference for ours.
#pragma once

extern "C" {
#include <mrcal/mrcal.h>
}

#include <Eigen/Core>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace spartan::testing {

/// A camera model of mrcal.
class MrcalModel {
 public:
  /// Name ("LENSMODEL_CAHVOR") and parameters in the order of mrcal. Throws std::invalid_argument where they do not
  /// fit.
  MrcalModel(const std::string& name, std::vector<double> intrinsics) : intrinsics_(std::move(intrinsics)) {
    if (!mrcal_lensmodel_from_name(&model_, name.c_str())) throw std::invalid_argument("mrcal has no model " + name);
    if (mrcal_lensmodel_num_params(&model_) != static_cast<int>(intrinsics_.size())) {
      throw std::invalid_argument(name + ": wrong number of parameters");
    }
  }
  Eigen::Vector2d project(const Eigen::Vector3d& point) const {
    mrcal_point3_t p;
    p.x = point.x(), p.y = point.y(), p.z = point.z();
    mrcal_point2_t q;
    if (!mrcal_project(&q, nullptr, nullptr, &p, 1, &model_, intrinsics_.data())) {
      throw std::runtime_error("mrcal_project failed");
    }
    return {q.x, q.y};
  }

 private:
  mrcal_lensmodel_t model_{};
  std::vector<double> intrinsics_;
};

}  // namespace spartan::testing
