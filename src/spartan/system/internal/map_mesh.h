// The global map as a triangle mesh, and its file in glTF.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/slam/global_map.h"

namespace spartan::internal {

/// A vertex a known cell, at its centre and elevation.
struct TerrainMesh {
  Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();  ///< world frame: the middle of the map
  std::vector<Eigen::Vector3f> vertices;               ///< relative to the origin, m
  std::vector<Eigen::Vector3f> normals;                ///< of length 1, upwards
  std::vector<Rgb8> colours;
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< counter-clockwise from above
};

/// Two triangles between four known cells, one between three.
TerrainMesh mesh_of(const MapView& view, const Image<Rgb8>& colours);

/// A binary glTF 2.0 file (.glb): one mesh with positions, normals and colours, turned to the y axis of glTF, which is
/// up.
std::string glb_file(const TerrainMesh& mesh);

}  // namespace spartan::internal
