#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <sstream>

#include "tools/interference/scene.hpp"

namespace probebox::interference {
namespace {

constexpr std::size_t kHead = 84, kTriangle = 50, kMostTriangles = 5'000'000;

void add(Mesh& mesh, const std::array<Point, 3>& corners) {
  const auto first = mesh.points.size();
  mesh.points.insert(mesh.points.end(), corners.begin(), corners.end());
  mesh.triangles.push_back({first, first + 1, first + 2});
}

bool readBinary(const std::string& bytes, Mesh& mesh) {
  std::uint32_t count = 0;
  if (bytes.size() < kHead) return false;
  std::memcpy(&count, bytes.data() + kHead - sizeof count, sizeof count);  // hosts are little endian, as STL is
  if (count > kMostTriangles || bytes.size() != kHead + kTriangle * count) return false;
  for (std::size_t k = 0; k < count; ++k) {
    std::array<float, 12> values{};  // normal, three corners
    std::memcpy(values.data(), bytes.data() + kHead + kTriangle * k, sizeof values);
    std::array<Point, 3> corners;
    for (std::size_t i = 0; i < 9; ++i) {
      if (!std::isfinite(values[3 + i])) return false;  // no distance could be measured to it
      corners[i / 3][i % 3] = double{values[3 + i]};
    }
    add(mesh, corners);
  }
  return true;
}

bool readText(const std::string& text, Mesh& mesh) {
  std::istringstream in{text};
  std::string word;
  if (!(in >> word) || word != "solid") return false;
  std::array<Point, 3> corners;
  std::size_t had = 0;
  while (in >> word) {
    if (word != "vertex") continue;
    auto& corner = corners[had++];
    if (!(in >> corner[0] >> corner[1] >> corner[2])) return false;
    if (had == corners.size()) add(mesh, corners), had = 0;
  }
  return had == 0;
}

}  // namespace

Outcome<Mesh> readStl(const std::filesystem::path& path) {
  std::error_code unknown;
  if (std::filesystem::is_directory(path, unknown)) return Error{path.string() + ": is a folder; name an STL file"};
  std::ifstream in{path, std::ios::binary};
  if (!in) return Error{path.string() + ": cannot be read (" + std::strerror(errno) + ")"};
  const std::string bytes{std::istreambuf_iterator<char>{in}, {}};
  Mesh mesh;
  const bool understood = readBinary(bytes, mesh) || readText(bytes, mesh);
  if (!understood || mesh.triangles.empty())
    return Error{path.string() + ": is no STL file with triangles; export the solid again"};
  return mesh;
}

}  // namespace probebox::interference
