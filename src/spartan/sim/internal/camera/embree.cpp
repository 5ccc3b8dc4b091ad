#include "spartan/sim/internal/camera/embree.h"

#include <fmt/format.h>

#include <stdexcept>

namespace spartan::sim::internal {

EmbreeDevice make_embree_device(int threads) {
  EmbreeDevice device(rtcNewDevice(fmt::format("threads={},isa=avx2", threads).c_str()));
  if (!device) throw std::runtime_error("cannot create an Embree device; a processor with AVX2 is required");
  return device;
}

EmbreeScene make_embree_scene(const EmbreeDevice& device) {
  EmbreeScene scene(rtcNewScene(device.get()));
  rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_ROBUST);
  return scene;
}

unsigned attach(const EmbreeScene& scene, RTCGeometry geometry) {
  rtcCommitGeometry(geometry);
  const unsigned id = rtcAttachGeometry(scene.get(), geometry);
  rtcReleaseGeometry(geometry);
  return id;
}

RTCRay8 embree_rays(const RayPacket& rays) {
  RTCRay8 r{};
  for (int i = 0; i < kPacket; ++i) {
    r.org_x[i] = rays.origin_x[i];
    r.org_y[i] = rays.origin_y[i];
    r.org_z[i] = rays.origin_z[i];
    r.dir_x[i] = rays.direction_x[i];
    r.dir_y[i] = rays.direction_y[i];
    r.dir_z[i] = rays.direction_z[i];
    r.tfar[i] = rays.max_distance[i];
    r.mask[i] = ~0U;
  }
  return r;
}

RTCIntersectContext coherent_rays() {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  return context;
}

std::uint32_t occluded_by(const EmbreeScene& scene, const RayPacket& rays) {
  RTCRay8 query = embree_rays(rays);
  RTCIntersectContext context = coherent_rays();
  rtcOccluded8(kAllRays, scene.get(), &context, &query);
  std::uint32_t blocked = 0;
  for (int i = 0; i < kPacket; ++i) {
    if (rays.max_distance[i] >= 0 && query.tfar[i] < 0) blocked |= 1U << i;
  }
  return blocked;
}

}  // namespace spartan::sim::internal
