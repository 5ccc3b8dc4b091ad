// Conversion between camera models: which ones are possible, and that the projection stays the same.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "spartan/rig/models/camera_model.h"

namespace spartan {
namespace {

const PinholeModel kExactPinhole{500, 510, 319.5, 239.5};
const Eigen::Vector3d kAboutZ = Eigen::Vector3d::UnitZ(), kTilted = Eigen::Vector3d(0.02, -0.01, 1).normalized();

struct Conversion {
  std::string what;
  CameraModel from;
  std::string simplest;           // name of simplest_equivalent()
  std::vector<std::string> into;  // names of all types that can represent it
};

const std::vector<std::string> kLikePinhole{"pinhole", "radial_tangential", "double_sphere", "cahv", "cahvor",
                                            "cahvore"};

std::vector<Conversion> conversions() {
  using Brown = RadialTangentialModel;
  using Fisheye = EquidistantModel;
  const auto cahvore = [](const Eigen::Vector3d& axis, CahvoreModel::Radial r, CahvoreModel::Entrance e, double l) {
    return CahvoreModel({kExactPinhole, 0}, axis, r, e, l);
  };
  return {
      {"pinhole", kExactPinhole, "pinhole", kLikePinhole},
      {"Brown, no distortion", Brown(kExactPinhole, {}), "pinhole", kLikePinhole},
      {"Brown, k1", Brown(kExactPinhole, {-0.1}), "radial_tangential", {"radial_tangential", "cahvor", "cahvore"}},
      {"Brown, k1 k2",
       Brown(kExactPinhole, {-0.1, 0.02}),
       "radial_tangential",
       {"radial_tangential", "cahvor", "cahvore"}},
      {"Brown, p1", Brown(kExactPinhole, {0, 0, 1e-3}), "radial_tangential", {"radial_tangential"}},
      {"Brown, k6", Brown(kExactPinhole, {0, 0, 0, 0, 0, 0, 0, 1e-3}), "radial_tangential", {"radial_tangential"}},
      {"fisheye", Fisheye(kExactPinhole, {0.02, -0.003, 0, 0}), "equidistant", {"equidistant", "cahvore"}},
      {"fisheye, no coefficients", Fisheye(kExactPinhole, {}), "equidistant", {"equidistant", "cahvore"}},
      {"fisheye, k3", Fisheye(kExactPinhole, {0.02, 0, 1e-3, 0}), "equidistant", {"equidistant"}},
      {"fisheye, k4", Fisheye(kExactPinhole, {0.02, 0, 0, 1e-3}), "equidistant", {"equidistant"}},
      {"double sphere", DoubleSphereModel{kExactPinhole, -0.2, 0.5}, "double_sphere", {"double_sphere"}},
      {"double sphere, alpha = 0", DoubleSphereModel{kExactPinhole, -0.2, 0}, "double_sphere", {"double_sphere"}},
      {"double sphere, xi = 0", DoubleSphereModel{kExactPinhole, 0, 0.5}, "double_sphere", {"double_sphere"}},
      {"double sphere, both 0", DoubleSphereModel{kExactPinhole, 0, 0}, "pinhole", kLikePinhole},
      {"CAHV, no skew", CahvModel{kExactPinhole, 0}, "pinhole", kLikePinhole},
      {"CAHV, skew", CahvModel{kExactPinhole, 2}, "cahv", {"cahv", "cahvor", "cahvore"}},
      {"CAHVOR, no distortion", CahvorModel({kExactPinhole, 2}, kTilted, {}), "cahv", {"cahv", "cahvor", "cahvore"}},
      {"CAHVOR about z",
       CahvorModel({kExactPinhole, 0}, kAboutZ, {0, -0.1, 0.02}),
       "radial_tangential",
       {"radial_tangential", "cahvor", "cahvore"}},
      {"CAHVOR, tilted", CahvorModel({kExactPinhole, 0}, kTilted, {0, -0.1, 0}), "cahvor", {"cahvor", "cahvore"}},
      {"CAHVOR, r0", CahvorModel({kExactPinhole, 0}, kAboutZ, {0.01, -0.1, 0}), "cahvor", {"cahvor", "cahvore"}},
      {"CAHVOR, skew", CahvorModel({kExactPinhole, 2}, kAboutZ, {0, -0.1, 0}), "cahvor", {"cahvor", "cahvore"}},
      {"CAHVORE, L = 1", cahvore(kTilted, {0, -0.1, 0}, {}, 1), "cahvor", {"cahvor", "cahvore"}},
      {"CAHVORE, L = 0", cahvore(kAboutZ, {0, 0.02, 0}, {}, 0), "equidistant", {"equidistant", "cahvore"}},
      {"CAHVORE, L = 0, tilted", cahvore(kTilted, {0, 0.02, 0}, {}, 0), "cahvore", {"cahvore"}},
      {"CAHVORE, L = 0.5", cahvore(kAboutZ, {0, 0.02, 0}, {}, 0.5), "cahvore", {"cahvore"}},
      {"CAHVORE, pupil", cahvore(kAboutZ, {0, 0.02, 0}, {0, 0.001, 0}, 1), "cahvore", {"cahvore"}},
  };
}

std::string name_of_model(const CameraModel& model) {
  return std::visit([](const auto& m) { return std::string(m.kName); }, model);
}

template <class Model>
void add_converted(const CameraModel& from, std::vector<CameraModel>& all) {
  if (const auto converted = converted_to<Model>(from)) all.emplace_back(*converted);
}

std::vector<CameraModel> all_conversions(const CameraModel& from) {
  std::vector<CameraModel> all;
  add_converted<PinholeModel>(from, all);
  add_converted<RadialTangentialModel>(from, all);
  add_converted<EquidistantModel>(from, all);
  add_converted<DoubleSphereModel>(from, all);
  add_converted<CahvModel>(from, all);
  add_converted<CahvorModel>(from, all);
  add_converted<CahvoreModel>(from, all);
  return all;
}

void expect_same_projection(const CameraModel& a, const CameraModel& b, const std::string& what) {
  for (double x = -0.4; x <= 0.4; x += 0.2) {
    for (double y = -0.3; y <= 0.3; y += 0.15) {
      const Eigen::Vector3d point = 2 * Eigen::Vector3d(x, y, 1);
      const auto project = [&](const auto& m) { return m.project(point); };
      const auto by_a = std::visit(project, a), by_b = std::visit(project, b);
      ASSERT_TRUE(by_a && by_b) << what;
      EXPECT_LE((*by_a - *by_b).norm(), 1e-9) << what << " at " << x << " " << y;
    }
  }
}

TEST(ModelConversion, IsExactOrRefused) {
  for (const Conversion& c : conversions()) {
    std::vector<std::string> names;
    for (const CameraModel& into : all_conversions(c.from)) {
      names.push_back(name_of_model(into));
      expect_same_projection(c.from, into, c.what + " as " + names.back());
    }
    EXPECT_EQ(names, c.into) << c.what;
  }
}

TEST(ModelConversion, SimplestModelIsExact) {
  for (const Conversion& c : conversions()) {
    const CameraModel simplest = simplest_equivalent(c.from);
    EXPECT_EQ(name_of_model(simplest), c.simplest) << c.what;
    expect_same_projection(c.from, simplest, c.what);
  }
}

TEST(ModelConversion, ParametersMakeTheSameModel) {
  for (const Conversion& c : conversions()) {
    const CameraModel again = with_parameters(c.from, parameters(c.from));
    EXPECT_EQ(parameters(again), parameters(c.from)) << c.what;
    expect_same_projection(c.from, again, c.what);
  }
}

TEST(ModelConversion, ParametersAreBoundedAsTheModelsState) {
  const auto bounds = [](const CameraModel& model, const std::string& key) {
    for (const ModelParameterSpec& kind : parameter_specs(model)) {
      if (kind.key == key) return std::pair(kind.least, kind.most);
    }
    return std::pair(0.0, 0.0);
  };
  EXPECT_EQ(bounds(DoubleSphereModel{}, "alpha"), std::pair(0.0, 1.0));
  EXPECT_EQ(bounds(CahvoreModel(), "linearity"), std::pair(-1.0, 1.0));
}

}  // namespace
}  // namespace spartan
