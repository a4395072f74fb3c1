#include "tools/probebox/view/cell_request_handler.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "board/describe/file_content.hpp"
#include "tools/probebox/commands/hit_report.hpp"

namespace probebox::view {
namespace {

using command::describe;
using interference::Hit;

constexpr std::size_t kMostPath = 20'000;  // corners of a path in a picture

const char* nameOf(board::SolidPart part) {
  constexpr std::array kNames{"machine", "fixture", "workpiece"};
  return kNames[static_cast<std::size_t>(part)];
}

const char* nameOf(board::SolidShape shape) {
  constexpr std::array kNames{"box", "cylinder", "sphere", "stl"};
  return kNames[static_cast<std::size_t>(shape)];
}

std::string nameOf(board::RotaryLetter letter) {
  return {"ABC"[static_cast<std::size_t>(letter)]};
}

Json describe(const board::CellRotary& axis) {
  return {{"letter", nameOf(axis.letter)},
          {"carries", axis.carries == board::Carries::tool ? "tool" : "solids"},
          {"direction", axis.direction},
          {"through_mm", axis.through_mm}};
}

Json describe(const board::CellSolid& solid, const std::vector<board::CellRotary>& rotary,
              const std::filesystem::path& folder) {
  Json object{{"name", solid.name},       {"part", nameOf(solid.part)},   {"shape", nameOf(solid.shape)},
              {"size_mm", solid.size_mm}, {"radius_mm", solid.radius_mm}, {"height_mm", solid.height_mm},
              {"at_mm", solid.at_mm},     {"turn_deg", solid.turn_deg}};
  object["moves_with"] = solid.moves_with ? Json(nameOf(rotary[*solid.moves_with].letter)) : Json(nullptr);
  if (solid.shape != board::SolidShape::mesh) return object;
  const auto mesh = interference::meshOf(solid, folder);
  if (!mesh) {
    object["problem"] = mesh.error().what;
    return object;
  }
  Json corners = Json::array();
  for (const auto& triangle : mesh->triangles) {
    for (const auto corner : triangle) {
      for (const double value : mesh->points[corner]) corners.push_back(value);
    }
  }
  object["corners_mm"] = corners;
  return object;
}

Json describe(const board::CellTool& tool) {
  const auto lengths = interference::lengthsOf(tool);
  return {{"number", tool.number},
          {"holder_radius_mm", tool.holder_radius_mm},
          {"holder_length_mm", tool.holder_length_mm},
          {"radius_mm", tool.radius_mm},
          {"cutting_mm", tool.cutting_mm},
          {"stored_length_mm", tool.length_mm},
          {"assembled_length_mm", lengths.assembled_mm},
          {"W1_mm", tool.w1_mm.value_or(std::array<double, 2>{})},
          {"tip_from_axis_mm", lengths.tip_mm},
          {"measured", lengths.measured}};
}

Trouble objection(std::string what) {
  return {command::ExitStatus::usage, "refused", std::move(what)};
}

Outcome<board::CellTool, Trouble> toolOf(const std::optional<board::Cell>& cell, std::uint32_t number) {
  if (!cell) return objection("there is no cell: start probebox view --cell cell.toml");
  const auto found = std::ranges::find(cell->tools, number, &board::CellTool::number);
  if (found == cell->tools.end()) return objection("the cell has no [[tool]] with number = " + std::to_string(number));
  return *found;
}

// As cell.toml is judged.
std::optional<Trouble> take(board::CellTool& tool, const Measured& measured) {
  const bool good = measured.assembled_mm >= tool.cutting_mm && measured.assembled_mm <= 1000 &&
                    std::abs(measured.w1_mm[0]) <= 10 && std::abs(measured.w1_mm[1]) <= 10;
  const double holder_mm = measured.holder_mm.value_or(tool.holder_length_mm);
  if (!(holder_mm >= 0.1 && holder_mm <= 1000))
    return objection("a holder of " + std::to_string(holder_mm) + " mm: correct [[holder]] in machine.toml of the box");
  if (!good)
    return objection("the measured length " + std::to_string(measured.assembled_mm) +
                     " mm, or its W1, does not fit tool " + std::to_string(tool.number) +
                     " of the cell: correct its cutting_mm, or measure again");
  tool.assembled_length_mm = measured.assembled_mm;
  tool.w1_mm = measured.w1_mm;
  tool.holder_length_mm = holder_mm;
  return std::nullopt;
}

// Arcs as chords. A place above everything is not drawn.
Json cornersOf(const std::vector<interference::Move>& path) {
  constexpr double kChord_rad = 0.1;
  Json corners = Json::array();
  std::size_t had = 0;
  for (const auto& move : path) {
    const auto count = static_cast<std::size_t>(std::ceil(std::max(1.0, std::abs(move.turn_rad) / kChord_rad)));
    if (move.to[2] == interference::kAbove_mm) continue;
    for (std::size_t k = 1; k <= count && had < kMostPath; ++k, ++had) {
      const double part = static_cast<double>(k) / static_cast<double>(count);
      corners.push_back({{"line", move.line},
                         {"rapid", move.way == interference::Way::rapid},
                         {"to", interference::placeOn(move, part)}});
    }
  }
  return corners;
}

std::optional<Measured> measuredIn(const nlohmann::json& asked) {
  const auto found = asked.find("measured");
  if (found == asked.end() || !found->is_object()) return std::nullopt;
  const auto number = [](const nlohmann::json& value) {
    return value.is_number() ? value.get<double>() : std::nan("");
  };
  const auto w1 = found->value("W1_mm", nlohmann::json::array());
  if (!w1.is_array() || w1.size() != 2) return Measured{std::nan(""), {}};
  Measured measured{number(found->value("assembled_mm", nlohmann::json{})), {number(w1[0]), number(w1[1])}};
  if (found->contains("holder_mm")) measured.holder_mm = number((*found)["holder_mm"]);
  return measured;
}

}  // namespace

Outcome<CellRequestHandler> CellRequestHandler::open(const std::string& path, std::function<bool()> stopped) {
  CellRequestHandler connection;
  connection.stopped_ = std::move(stopped);
  if (path.empty()) return connection;
  const auto text = board::fileContent(path);
  if (!text) return Error{path + ": cannot be read (" + text.error().what + ")"};
  TRY(auto cell, board::parseCell(*text, std::filesystem::path{path}.filename().string()));
  connection.cell_ = std::move(cell);
  connection.folder_ = std::filesystem::path{path}.parent_path();
  return connection;
}

std::string CellRequestHandler::scene() const {
  if (!cell_) return "null";
  Json rotary = Json::array(), solids = Json::array(), tools = Json::array();
  for (const auto& axis : cell_->rotary) rotary.push_back(describe(axis));
  for (const auto& solid : cell_->solids) solids.push_back(describe(solid, cell_->rotary, folder_));
  for (const auto& tool : cell_->tools) tools.push_back(describe(tool));
  return Json{{"name", cell_->name},
              {"program_zero_mm", cell_->program_zero_mm},
              {"least_mm", cell_->least_mm},
              {"rotary", rotary},
              {"solids", solids},
              {"tools", tools}}
      .dump();
}

BoxConnection::Answer CellRequestHandler::nearest(std::uint32_t number, const std::optional<Measured>& measured,
                                                  const interference::Pose& pose) const {
  TRY(auto tool, toolOf(cell_, number));
  if (measured) {
    if (auto trouble = take(tool, *measured)) return *trouble;
  }
  const auto near = [](double value) { return std::abs(value) <= 1e5; };
  if (!std::ranges::all_of(pose.tip, near) || !std::ranges::all_of(pose.angles_deg, near))
    return objection("x, y and z have to be machine positions, mm, and a, b and c angles, degrees");
  const auto scene = interference::Scene::open(*cell_, tool, folder_);
  if (!scene) return objection(scene.error().what);
  return describe(Hit{0, number, pose, (*scene)->nearest(pose, false), 0}).dump();
}

BoxConnection::Answer CellRequestHandler::check(const std::string& body) const {
  const auto asked = nlohmann::json::parse(body, nullptr, false);
  if (!asked.is_object() || !asked.contains("tool") || !asked["tool"].is_number_unsigned() ||
      !asked.contains("program") || !asked["program"].is_string())
    return objection("a check needs the number of a tool and a program");
  TRY(auto tool, toolOf(cell_, asked["tool"].get<std::uint32_t>()));
  if (const auto measured = measuredIn(asked)) {
    if (auto trouble = take(tool, *measured)) return *trouble;
  }
  if (asked.contains("stored") && asked["stored"] == true) tool.assembled_length_mm.reset(), tool.w1_mm.reset();
  const auto path =
      interference::readProgram(asked["program"].get<std::string>(), interference::dialectOf(*cell_, tool.number));
  if (!path) return objection(path.error().sentence());
  auto tools = cell_->tools;
  std::ranges::replace_if(
      tools, [&](const auto& one) { return one.number == tool.number; }, tool);
  const auto mounted = interference::mount(*cell_, tools, *path, folder_);
  if (!mounted) return objection(mounted.error().what);
  interference::Settings settings;
  settings.stopped = stopped_;
  const auto report = interference::check(*cell_, *mounted, *path, settings);
  if (stopped_()) return objection("probebox view has ended: start it again");
  Json hits = Json::array();
  for (const auto& hit : report.hits) hits.push_back(describe(hit));
  const auto& first = path->front();
  Json left = Json::array();
  for (const auto& one : report.left)
    left.push_back({{"solid", one.solid},
                    {"cell_mm", one.heights.cell_mm},
                    {"columns", one.heights.columns},
                    {"rows", one.heights.rows},
                    {"heights_mm", one.heights.mm}});
  return Json{{"moves", report.moves},
              {"path_mm", report.length_mm},
              {"removed_mm3", report.removed_mm3},
              {"nearest", report.nearest ? describe(*report.nearest) : Json(nullptr)},
              {"left", left},
              {"hits", hits},
              {"from", first.from[2] == interference::kAbove_mm ? first.to : first.from},
              {"path", cornersOf(*path)}}
      .dump();
}

}  // namespace probebox::view
