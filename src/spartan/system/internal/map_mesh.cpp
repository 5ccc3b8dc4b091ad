#include "spartan/system/internal/map_mesh.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>

namespace spartan::internal {
namespace {

constexpr std::uint32_t kNoVertex = UINT32_MAX;

// Number of the vertex of each cell, in the order of the cells.
Image<std::uint32_t> vertex_numbers(const MapView& view) {
  Image<std::uint32_t> numbers(view.window.width, view.window.height);
  std::uint32_t next = 0;
  for (int r = 0; r < view.window.height; ++r) {
    for (int c = 0; c < view.window.width; ++c) numbers(c, r) = view.count(c, r) > 0 ? next++ : kNoVertex;
  }
  return numbers;
}

void add_triangles(const Image<std::uint32_t>& numbers, TerrainMesh& mesh) {
  for (int r = 0; r + 1 < numbers.height(); ++r) {
    for (int c = 0; c + 1 < numbers.width(); ++c) {
      // Counter-clockwise from above: row 0 is in the north.
      const std::array<std::uint32_t, 4> corners{numbers(c, r), numbers(c, r + 1), numbers(c + 1, r + 1),
                                                 numbers(c + 1, r)};
      std::vector<std::uint32_t> known;
      std::copy_if(corners.begin(), corners.end(), std::back_inserter(known),
                   [](std::uint32_t number) { return number != kNoVertex; });
      if (known.size() < 3) continue;
      mesh.triangles.push_back({known[0], known[1], known[2]});
      if (known.size() == 4) mesh.triangles.push_back({known[0], known[2], known[3]});
    }
  }
}

// Of the triangles around each vertex, weighted by their areas; upwards where there is none.
std::vector<Eigen::Vector3f> vertex_normals(const TerrainMesh& mesh) {
  std::vector<Eigen::Vector3f> normals(mesh.vertices.size(), Eigen::Vector3f::Zero());
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3f a = mesh.vertices[t[0]], b = mesh.vertices[t[1]], c = mesh.vertices[t[2]];
    const Eigen::Vector3f area = (b - a).cross(c - a);
    for (const std::uint32_t vertex : t) normals[vertex] += area;
  }
  for (Eigen::Vector3f& normal : normals) {
    const float length = normal.norm();
    normal = length > 0 ? Eigen::Vector3f(normal / length) : Eigen::Vector3f::UnitZ();
  }
  return normals;
}

// glTF has linear colours; those of images are sRGB (IEC 61966-2-1).
std::uint16_t linear(std::uint8_t level) {
  const double v = level / 255.0;
  const double value = v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
  return static_cast<std::uint16_t>(std::lround(65535 * value));
}

class Buffer {
 public:
  // Elements of four bytes, or of a multiple; the parts stay aligned.
  template <class Element>
  nlohmann::json add(const std::vector<Element>& elements, int target) {
    static_assert(sizeof(Element) % 4 == 0);
    const std::size_t offset = bytes_.size(), length = elements.size() * sizeof(Element);
    bytes_.append(reinterpret_cast<const char*>(elements.data()), length);
    return {{"buffer", 0}, {"byteOffset", offset}, {"byteLength", length}, {"target", target}};
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

void append_chunk(std::string& file, std::string content, std::uint32_t type, char padding) {
  content.resize((content.size() + 3) / 4 * 4, padding);
  for (const std::uint32_t word : {static_cast<std::uint32_t>(content.size()), type})
    file.append(reinterpret_cast<const char*>(&word), sizeof(word));
  file += content;
}

// Least and largest coordinates, which the format asks for.
void add_bounds(const std::vector<Eigen::Vector3f>& vertices, nlohmann::json& accessor) {
  Eigen::Vector3f least = vertices.front(), largest = vertices.front();
  for (const Eigen::Vector3f& v : vertices) {
    least = least.cwiseMin(v);
    largest = largest.cwiseMax(v);
  }
  accessor["min"] = {least.x(), least.y(), least.z()};
  accessor["max"] = {largest.x(), largest.y(), largest.z()};
}

}  // namespace

TerrainMesh mesh_of(const MapView& view, const Image<Rgb8>& colours) {
  TerrainMesh mesh;
  const GeoTransform place = view.place();
  mesh.origin_m = {place.west_m + view.window.width * view.cell_m / 2,
                   place.north_m - view.window.height * view.cell_m / 2, 0};
  for (int r = 0; r < view.window.height; ++r) {
    for (int c = 0; c < view.window.width; ++c) {
      if (!(view.count(c, r) > 0)) continue;
      const Eigen::Vector2d at = cell_centre(place, c, r);
      const Eigen::Vector3d centre(at.x(), at.y(), static_cast<double>(view.elevation_m(c, r)));
      mesh.vertices.emplace_back((centre - mesh.origin_m).cast<float>());
      mesh.colours.push_back(colours(c, r));
    }
  }
  add_triangles(vertex_numbers(view), mesh);
  mesh.normals = vertex_normals(mesh);
  return mesh;
}

std::string glb_file(const TerrainMesh& mesh) {
  constexpr int kVertices = 34962, kIndices = 34963;                     // targets
  constexpr int kFloat = 5126, kUnsignedShort = 5123, kUnsigned = 5125;  // component types
  std::vector<std::array<std::uint16_t, 4>> colours;
  colours.reserve(mesh.colours.size());
  for (const Rgb8& c : mesh.colours) colours.push_back({linear(c.r), linear(c.g), linear(c.b), 65535});
  Buffer buffer;
  const nlohmann::json views = {buffer.add(mesh.vertices, kVertices), buffer.add(mesh.normals, kVertices),
                                buffer.add(colours, kVertices), buffer.add(mesh.triangles, kIndices)};
  nlohmann::json positions = {
      {"bufferView", 0}, {"componentType", kFloat}, {"count", mesh.vertices.size()}, {"type", "VEC3"}};
  if (!mesh.vertices.empty()) add_bounds(mesh.vertices, positions);
  const nlohmann::json json = {
      {"asset", {{"version", "2.0"}, {"generator", "Spartan"}}},
      {"scene", 0},
      {"scenes", {{{"nodes", {0}}}}},
      // World (x, y, z) to glTF (x, z, −y): a quarter turn about x.
      {"nodes",
       {{{"name", "terrain"},
         {"mesh", 0},
         {"rotation", {-std::sqrt(0.5), 0, 0, std::sqrt(0.5)}},
         {"translation", {mesh.origin_m.x(), mesh.origin_m.z(), -mesh.origin_m.y()}}}}},
      {"materials",
       {{{"name", "ground"},
         {"doubleSided", true},
         {"pbrMetallicRoughness", {{"metallicFactor", 0}, {"roughnessFactor", 1}}}}}},
      {"meshes",
       {{{"name", "terrain"},
         {"primitives",
          {{{"attributes", {{"POSITION", 0}, {"NORMAL", 1}, {"COLOR_0", 2}}}, {"indices", 3}, {"material", 0}}}}}}},
      {"accessors",
       {positions,
        {{"bufferView", 1}, {"componentType", kFloat}, {"count", mesh.normals.size()}, {"type", "VEC3"}},
        {{"bufferView", 2},
         {"componentType", kUnsignedShort},
         {"normalized", true},
         {"count", colours.size()},
         {"type", "VEC4"}},
        {{"bufferView", 3}, {"componentType", kUnsigned}, {"count", 3 * mesh.triangles.size()}, {"type", "SCALAR"}}}},
      {"bufferViews", views},
      {"buffers", {{{"byteLength", buffer.bytes().size()}}}}};
  std::string chunks;
  append_chunk(chunks, json.dump(), 0x4E4F534A, ' ');      // "JSON"
  append_chunk(chunks, buffer.bytes(), 0x004E4942, '\0');  // "BIN"
  std::string file = "glTF";
  for (const std::uint32_t word : {2U, static_cast<std::uint32_t>(12 + chunks.size())})
    file.append(reinterpret_cast<const char*>(&word), sizeof(word));
  return file + chunks;
}

}  // namespace spartan::internal
