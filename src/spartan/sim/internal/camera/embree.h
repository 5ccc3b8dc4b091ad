// What the scenes have in common that are traced by Embree.
#pragma once

#include <embree3/rtcore.h>

#include <memory>

#include "spartan/sim/internal/camera/ground_scene.h"

namespace spartan::sim::internal {

struct ReleaseEmbree {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};
using EmbreeDevice = std::unique_ptr<RTCDeviceTy, ReleaseEmbree>;
using EmbreeScene = std::unique_ptr<RTCSceneTy, ReleaseEmbree>;

/// A device of a fixed instruction set, which gives the same hits on every machine; its threads build the BVH only.
/// Throws std::runtime_error without AVX2.
EmbreeDevice make_embree_device(int threads);
/// An empty scene without gaps between triangles.
EmbreeScene make_embree_scene(const EmbreeDevice& device);
/// Commits a geometry and hands it over to the scene; returns its id.
unsigned attach(const EmbreeScene& scene, RTCGeometry geometry);

RTCRay8 embree_rays(const RayPacket& rays);
RTCIntersectContext coherent_rays();
inline constexpr int kAllRays[kPacket] = {-1, -1, -1, -1, -1, -1, -1, -1};
/// Bit i: ray i hits something.
std::uint32_t occluded_by(const EmbreeScene& scene, const RayPacket& rays);

}  // namespace spartan::sim::internal
