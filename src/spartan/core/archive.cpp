#include "spartan/core/archive.h"

#include <algorithm>
#include <cmath>

namespace spartan {

void Hash64::add(const void* data, std::size_t size) {
  add(size);
  const auto* bytes = static_cast<const std::uint8_t*>(data);
  while (size > 0) {
    std::uint64_t word = 0;
    const std::size_t count = std::min(size, sizeof word);
    std::memcpy(&word, bytes, count);
    add(word);
    bytes += count;
    size -= count;
  }
}

void ArchiveWriter::raw(const void* data, std::size_t size) {
  if (size == 0) return;
  const auto* first = static_cast<const std::uint8_t*>(data);
  bytes_.insert(bytes_.end(), first, first + size);
}

void ArchiveWriter::put(const std::string& text) {
  put_array(text.data(), text.size());
}
void ArchiveWriter::put(const Eigen::Vector2d& v) {
  raw(v.data(), sizeof(double) * 2);
}
void ArchiveWriter::put(const Eigen::Vector3d& v) {
  raw(v.data(), sizeof(double) * 3);
}
void ArchiveWriter::put(const Pose& pose) {
  raw(pose.rotation().coeffs().data(), sizeof(double) * 4);
  put(pose.translation());
}
void ArchiveWriter::put(const Matrix6d& m) {
  raw(m.data(), sizeof(double) * 36);
}

void ArchiveReader::raw(void* data, std::size_t size) {
  if (size > remaining()) {
    ok_ = false;
    return;
  }
  if (size == 0) return;
  std::memcpy(data, bytes_.data() + offset_, size);
  offset_ += size;
}

std::string ArchiveReader::get_string() {
  const std::vector<char> text = get_array<char>();
  return {text.begin(), text.end()};
}
Stamp ArchiveReader::get_stamp() {
  const Stamp stamp{get<std::int64_t>()};
  plausible_ = plausible_ && std::abs(stamp.seconds()) <= kMostSeconds;
  return stamp;
}
double ArchiveReader::get_finite() {
  const auto value = get<double>();
  plausible_ = plausible_ && std::isfinite(value);
  return value;
}
Eigen::Vector2d ArchiveReader::get_vector2() {
  Eigen::Vector2d v = Eigen::Vector2d::Zero();
  raw(v.data(), sizeof(double) * 2);
  plausible_ = plausible_ && v.allFinite();
  return v;
}
Eigen::Vector3d ArchiveReader::get_vector3() {
  Eigen::Vector3d v = Eigen::Vector3d::Zero();
  raw(v.data(), sizeof(double) * 3);
  plausible_ = plausible_ && v.allFinite();
  return v;
}
Pose ArchiveReader::get_pose() {
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  raw(q.coeffs().data(), sizeof(double) * 4);
  const Eigen::Vector3d translation = get_vector3();
  plausible_ = plausible_ && std::abs(q.norm() - 1) < 1e-6 && translation.norm() < kFarthest_m;
  return Pose::from_unit_quaternion(q, translation);
}
Matrix6d ArchiveReader::get_matrix6() {
  Matrix6d m = Matrix6d::Zero();
  raw(m.data(), sizeof(double) * 36);
  plausible_ = plausible_ && m.allFinite();
  return m;
}

Status ArchiveReader::expect_version(std::uint32_t version, const std::string& what) {
  const auto found = get<std::uint32_t>();
  if (!ok_) return failure(ErrorCode::store_damaged, "the saved state is truncated", what);
  if (found == version) return {};
  return failure(ErrorCode::configuration,
                 "has version " + std::to_string(found) + ", but this program reads version " + std::to_string(version),
                 what, "run again into a new folder");
}

Status ArchiveReader::finish(const std::string& what) const {
  if (!ok_) return failure(ErrorCode::store_damaged, "the saved state is truncated", what);
  if (!plausible_) return failure(ErrorCode::store_damaged, "is damaged: a number is out of bounds", what);
  if (offset_ != bytes_.size())
    return failure(ErrorCode::store_damaged, "the saved state has unexpected bytes at its end", what);
  return {};
}

}  // namespace spartan
