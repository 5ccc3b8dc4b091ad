#include "spartan/core/archive.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>

namespace spartan {
namespace {

enum class State : std::uint8_t { tracking = 3 };

Bytes example() {
  ArchiveWriter writer;
  writer.put(std::uint32_t{7});
  writer.put(true);
  writer.put(State::tracking);
  writer.put(std::string("mast"));
  writer.put(Eigen::Vector2d(1, -2));
  writer.put(Pose(exp_so3({0.1, 0.2, 0.3}), {4, 5, 6}));
  writer.put(Matrix6d(Matrix6d::Identity() * 0.1));
  const std::vector<float> row{1.5F, std::nanf(""), -0.0F};
  writer.put_array(row.data(), row.size());
  return writer.take();
}

void read_example(ArchiveReader& reader) {
  reader.get<std::uint32_t>();
  reader.get<bool>();
  reader.get<State>();
  reader.get_string();
  reader.get_vector2();
  reader.get_pose();
  reader.get_matrix6();
  reader.get_array<float>();
}

TEST(Archive, RoundTripsEveryTypeOfValue) {
  const Bytes bytes = example();
  ArchiveReader reader(bytes);
  EXPECT_EQ(reader.get<std::uint32_t>(), 7U);
  EXPECT_TRUE(reader.get<bool>());
  EXPECT_EQ(reader.get<State>(), State::tracking);
  EXPECT_EQ(reader.get_string(), "mast");
  EXPECT_EQ(reader.get_vector2(), Eigen::Vector2d(1, -2));
  const Pose pose = reader.get_pose(), expected(exp_so3({0.1, 0.2, 0.3}), {4, 5, 6});
  EXPECT_EQ(pose.rotation().coeffs(), expected.rotation().coeffs()) << "bit for bit";
  EXPECT_EQ(pose.translation(), expected.translation());
  EXPECT_EQ(reader.get_matrix6(), Matrix6d(Matrix6d::Identity() * 0.1));
  const auto row = reader.get_array<float>();
  ASSERT_EQ(row.size(), 3U);
  EXPECT_TRUE(std::isnan(row[1]));
  EXPECT_TRUE(std::signbit(row[2]));
  EXPECT_TRUE(reader.finish("example"));
}

TEST(Archive, TellsAnotherVersionFromDamage) {
  ArchiveWriter writer;
  writer.put(std::uint32_t{7});
  const Bytes bytes = writer.take(), cut(bytes.begin(), bytes.begin() + 3);
  EXPECT_TRUE(ArchiveReader(bytes).expect_version(7, "state"));
  const Status other = ArchiveReader(bytes).expect_version(8, "state");
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().code, ErrorCode::configuration);
  EXPECT_EQ(other.error().what, "has version 7, but this program reads version 8");
  EXPECT_EQ(ArchiveReader(cut).expect_version(7, "state").error().code, ErrorCode::store_damaged);
}

// The bytes of a value, read by `read`.
template <class Value, class Read>
bool is_accepted(const Value& value, const Read& read) {
  ArchiveWriter writer;
  writer.put(value);
  const Bytes bytes = writer.take();
  ArchiveReader reader(bytes);
  read(reader);
  const Status status = reader.finish("state");
  EXPECT_EQ(status.has_value(), reader.ok());
  if (!status) {
    EXPECT_EQ(status.error().what, "is damaged: a number is out of bounds");
  }
  return status.has_value();
}

TEST(Archive, RefusesValuesThatNoProgramSaves) {
  const double nan = std::nan(""), infinite = std::numeric_limits<double>::infinity();
  const auto pose = [](ArchiveReader& reader) { reader.get_pose(); };
  EXPECT_TRUE(is_accepted(Pose::from_translation({1e6, 0, 0}), pose));
  EXPECT_FALSE(is_accepted(Pose::from_translation({1e8, 0, 0}), pose));
  EXPECT_FALSE(is_accepted(Pose::from_translation({nan, 0, 0}), pose));
  EXPECT_FALSE(is_accepted(Pose::from_unit_quaternion({0, 0, 0, 0}, {1, 2, 3}), pose));
  const auto vector = [](ArchiveReader& reader) { reader.get_vector3(); };
  EXPECT_TRUE(is_accepted(Eigen::Vector3d(1, 2, 3), vector));
  EXPECT_FALSE(is_accepted(Eigen::Vector3d(1, infinite, 3), vector));
  EXPECT_FALSE(is_accepted(Eigen::Vector2d(nan, 1), [](ArchiveReader& reader) { reader.get_vector2(); }));
  EXPECT_FALSE(is_accepted(Matrix6d(nan * Matrix6d::Identity()), [](ArchiveReader& reader) { reader.get_matrix6(); }));
  const auto number = [](ArchiveReader& reader) { reader.get_finite(); };
  EXPECT_TRUE(is_accepted(1e300, number));
  EXPECT_FALSE(is_accepted(infinite, number));
  const auto stamp = [](ArchiveReader& reader) { reader.get_stamp(); };
  EXPECT_TRUE(is_accepted(std::int64_t{1'700'000'000'000'000'000}, stamp)) << "of the year 2023";
  EXPECT_FALSE(is_accepted(std::numeric_limits<std::int64_t>::min(), stamp));
}

TEST(Archive, DetectsEveryTruncation) {
  const Bytes whole = example();
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const Bytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
    ArchiveReader reader(cut);
    read_example(reader);
    const Status status = reader.finish("odometry state");
    ASSERT_FALSE(status) << size;
    EXPECT_EQ(status.error().code, ErrorCode::store_damaged);
    EXPECT_EQ(status.error().where, "odometry state");
  }
}

TEST(Archive, DetectsExtraBytes) {
  Bytes bytes = example();
  bytes.push_back(0);
  ArchiveReader reader(bytes);
  read_example(reader);
  EXPECT_FALSE(reader.finish("example"));
}

TEST(Archive, RejectsAnArrayLongerThanItsBytes) {
  ArchiveWriter writer;
  writer.put(~std::uint64_t{0});
  const Bytes bytes = writer.take();
  ArchiveReader reader(bytes);
  EXPECT_TRUE(reader.get_array<double>().empty());
  EXPECT_EQ(reader.get<int>(), 0) << "values after an error are zero";
  EXPECT_FALSE(reader.finish("example"));
}

RC_GTEST_PROP(Archive, RoundTripsArraysAndText,
              (const std::vector<std::int32_t>& numbers, const std::string& text, double value)) {
  ArchiveWriter writer;
  writer.put_array(numbers.data(), numbers.size());
  writer.put(text);
  writer.put(value);
  const Bytes bytes = writer.take();
  ArchiveReader reader(bytes);
  RC_ASSERT(reader.get_array<std::int32_t>() == numbers);
  RC_ASSERT(reader.get_string() == text);
  RC_ASSERT(std::bit_cast<std::uint64_t>(reader.get<double>()) == std::bit_cast<std::uint64_t>(value));
  RC_ASSERT(reader.finish("property").has_value());
}

// Any bytes are read without access out of bounds (checked by the sanitizers) and end with a status.
RC_GTEST_PROP(Archive, SurvivesAnyBytes, (const Bytes& bytes)) {
  ArchiveReader reader(bytes);
  read_example(reader);
  RC_ASSERT(bytes.size() >= 382 || !reader.finish("noise"));  // the fixed part alone has 382 bytes
}

}  // namespace
}  // namespace spartan
