// A point cloud as a type of its own.
#pragma once

#include "spartan/reconstruction/point_cloud.h"

namespace spartan::python {

struct PointCloudValue {
  PointCloud points;
};

}  // namespace spartan::python
