#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <sstream>

#include "board/describe/file_content.hpp"
#include "tools/interference/scene.hpp"

namespace probebox::interference {
namespace {

constexpr std::size_t kHead = 84, kTriangle = 50, kMostTriangles = 5'000'000;
constexpr std::size_t kMostBytes = 1'000'000'000;  // of the text of as many
constexpr double kFarthest_mm = 1e5;               // of a corner from the origin

constexpr const char* kNoStl = "is no STL file with triangles; export the solid again";
constexpr const char* kCutOff = "ends before endsolid: copy it again";
constexpr const char* kCutOffBinary = "ends before its last triangle: copy it again";
constexpr const char* kWide = "is text in UTF-16; save it as UTF-8 or plain text";
constexpr const char* kOneLine = "is no STL file with lines; export the solid again";
constexpr const char* kTooFar = "has a corner more than 100 m from its origin: export the solid in mm";
constexpr const char* kTooLong = "has more than 5 million triangles: export the solid more coarsely";

bool isNear(const Point& corner) {
  return std::ranges::all_of(corner, [](double value) { return std::abs(value) <= kFarthest_mm; });
}

void add(Mesh& mesh, const std::array<Point, 3>& corners) {
  const auto first = mesh.points.size();
  mesh.points.insert(mesh.points.end(), corners.begin(), corners.end());
  mesh.triangles.push_back({first, first + 1, first + 2});
}

// A text has no control characters but blanks. The name of a binary file may begin with "solid" as well.
bool isText(const std::string& bytes) {
  return std::ranges::none_of(bytes.substr(0, kHead + kTriangle),
                              [](unsigned char c) { return c < ' ' && std::isspace(c) == 0; });
}

// Returns what is wrong with the file; nullptr for nothing.
// Behind its triangles other bytes may follow.
const char* readBinary(const std::string& bytes, Mesh& mesh) {
  std::uint32_t count = 0;
  if (bytes.size() < kHead) return kNoStl;
  std::memcpy(&count, bytes.data() + kHead - sizeof count, sizeof count);  // hosts are little endian, as STL is
  if (count > kMostTriangles) return kNoStl;
  if (bytes.size() < kHead + kTriangle * count) return kCutOffBinary;
  for (std::size_t at = kHead; at < kHead + kTriangle * count; at += kTriangle) {
    std::array<float, 12> values{};  // normal, three corners
    std::memcpy(values.data(), bytes.data() + at, sizeof values);
    std::array<Point, 3> corners;
    for (std::size_t i = 0; i < 9; ++i) {
      if (!std::isfinite(values[3 + i])) return kNoStl;  // no distance could be measured to it
      corners[i / 3][i % 3] = double{values[3 + i]};
    }
    if (!std::ranges::all_of(corners, isNear)) return kTooFar;
    add(mesh, corners);
  }
  return nullptr;
}

// In small letters, with one kind of line end, and without the mark of UTF-8.
std::string plain(std::string text) {
  if (text.starts_with("\xEF\xBB\xBF")) text.erase(0, 3);
  for (auto& c : text) c = c == '\r' ? '\n' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

const char* readText(const std::string& text, Mesh& mesh) {
  std::istringstream in{plain(text)};
  std::string word;
  if (!(in >> word) || word != "solid") return kNoStl;
  std::array<Point, 3> corners;
  std::size_t had = 0;
  bool ended = false;
  do {
    if (word == "solid" || word == "endsolid" || word == "end") {
      ended = word != "solid";
      std::getline(in, word);  // its name
      if (word.find(" facet normal ") != std::string::npos) return kOneLine;
    } else if (word == "vertex") {
      if (had == corners.size()) return kNoStl;
      auto& corner = corners[had++];
      if (!(in >> corner[0] >> corner[1] >> corner[2])) return in.eof() ? kCutOff : kNoStl;
      if (!isNear(corner)) return kTooFar;
    } else if (word == "endfacet") {
      if (had != corners.size()) return kNoStl;
      add(mesh, corners), had = 0;
    }
  } while (in >> word);
  return had == 0 && ended ? nullptr : kCutOff;
}

}  // namespace

Outcome<Mesh> readStl(const std::filesystem::path& path) {
  const auto bytes = board::fileContent(path, kMostBytes);
  if (!bytes) return Error{path.string() + ": cannot be read (" + bytes.error().what + ")"};
  if (bytes->size() == kMostBytes) return Error{path.string() + ": " + kTooLong};
  Mesh mesh;
  const bool wide = bytes->starts_with("\xFF\xFE") || bytes->starts_with("\xFE\xFF");
  const char* wrong = wide ? kWide : isText(*bytes) ? readText(*bytes, mesh) : readBinary(*bytes, mesh);
  if (wrong == nullptr && mesh.triangles.empty()) wrong = kNoStl;
  if (wrong != nullptr) return Error{path.string() + ": " + wrong};
  return mesh;
}

}  // namespace probebox::interference
