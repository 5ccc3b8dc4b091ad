// Binary serialization of stage states for checkpoints: little-endian, checked when read. Each stage writes a version
// number of its own first.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

#include "spartan/core/pose.h"
#include "spartan/core/result.h"
#include "spartan/core/time.h"

namespace spartan {

using Bytes = std::vector<std::uint8_t>;

static_assert(std::endian::native == std::endian::little, "archives hold the memory layout of a little-endian machine");

/// 64-bit hash of a sequence of byte strings and numbers, 8 bytes a step: as FNV-1a (Fowler, Noll, Vo), with words in
/// place of bytes and the upper half mixed into the lower one. It detects changes and damage; it does not resist an
/// attacker.
class Hash64 {
 public:
  std::uint64_t value() const { return value_; }
  void add(std::uint64_t word) {
    value_ = (value_ ^ word) * 0x100000001b3U;
    value_ ^= value_ >> 32U;
  }
  /// The number of bytes, and the bytes.
  void add(const void* data, std::size_t size);

 private:
  std::uint64_t value_ = 0xcbf29ce484222325U;
};

/// Appends values to a byte string.
class ArchiveWriter {
 public:
  template <class T>
    requires std::is_arithmetic_v<T> || std::is_enum_v<T>
  void put(T value) {
    raw(&value, sizeof value);
  }
  void put(const std::string& text);
  void put(const Eigen::Vector2d& v);
  void put(const Eigen::Vector3d& v);
  void put(const Pose& pose);
  void put(const Matrix6d& m);
  /// The number of elements (uint64), then the elements in their memory layout.
  template <class T>
    requires std::is_trivially_copyable_v<T>
  void put_array(const T* data, std::size_t count) {
    put(static_cast<std::uint64_t>(count));
    raw(data, count * sizeof(T));
  }
  Bytes take() { return std::move(bytes_); }

 private:
  void raw(const void* data, std::size_t size);
  Bytes bytes_;
};

/// Reads what ArchiveWriter wrote, in the same order. After the first value beyond the end of the bytes, that value and
/// all following ones are zero; call finish() at the end to check for errors. Values that no program saves are errors
/// as well: vectors, matrices and poses with numbers that are not finite, poses without a unit quaternion or beyond
/// kFarthest_m, stamps beyond kMostSeconds.
class ArchiveReader {
 public:
  /// Bounds of poses and stamps: cells of 5 mm and differences of stamps in nanoseconds can be counted.
  static constexpr double kFarthest_m = 1e7;
  static constexpr std::int64_t kMostSeconds = 4'000'000'000;

  /// Keeps a reference to the bytes, which must outlive the reader.
  explicit ArchiveReader(const Bytes& bytes) : bytes_(bytes) {}
  explicit ArchiveReader(Bytes&&) = delete;

  template <class T>
    requires std::is_arithmetic_v<T> || std::is_enum_v<T>
  T get() {
    if constexpr (std::is_same_v<T, bool>) {
      return get<std::uint8_t>() != 0;  // a bool with a byte value other than 0 and 1 is undefined behaviour
    } else {
      T value{};
      raw(&value, sizeof value);
      return value;
    }
  }
  std::string get_string();
  Stamp get_stamp();
  double get_finite();
  Eigen::Vector2d get_vector2();
  Eigen::Vector3d get_vector3();
  Pose get_pose();
  Matrix6d get_matrix6();
  template <class T>
    requires std::is_trivially_copyable_v<T>
  std::vector<T> get_array() {
    const auto count = get<std::uint64_t>();
    if (count > remaining() / sizeof(T)) {
      ok_ = false;
      return {};
    }
    std::vector<T> values(static_cast<std::size_t>(count));
    raw(values.data(), values.size() * sizeof(T));
    return values;
  }

  /// Reads the version that a saved state begins with. Code `configuration` where it is another one, `store_damaged`
  /// where the bytes end before it; `what` names the state.
  Status expect_version(std::uint32_t version, const std::string& what);
  /// Whether all values so far were present and possible.
  bool ok() const { return ok_ && plausible_; }
  /// Checks that every value was present and possible and no byte is left over; otherwise an error of code
  /// `store_damaged` at `what`.
  Status finish(const std::string& what) const;

 private:
  std::size_t remaining() const { return ok_ ? bytes_.size() - offset_ : 0; }
  void raw(void* data, std::size_t size);
  const Bytes& bytes_;
  std::size_t offset_ = 0;
  bool ok_ = true;         // no value was beyond the end
  bool plausible_ = true;  // all values were such as a program saves
};

}  // namespace spartan
