#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <utility>

#include "board/describe/file_content.hpp"
#include "protocol/units/megabytes.hpp"
#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/commands/hit_report.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

using interference::Hit;
using interference::Pose;

constexpr std::size_t kShown = 10;
constexpr std::size_t kMostProgram = 1'000'000'000;  // bytes

Trouble unreadableInput(std::string what) {
  return {ExitStatus::usage, "unreadable-input", std::move(what)};
}

Outcome<std::string, Trouble> contentOf(const std::string& path, std::size_t most_bytes) {
  auto text = board::fileContent(path, most_bytes);
  if (!text) return unreadableInput(path + ": cannot be read (" + text.error().what + ")");
  return std::move(text).value();
}

Outcome<std::string, Trouble> programIn(const std::string& path, Console& console) {
  if (path == "-") return std::string{std::istreambuf_iterator<char>{console.in()}, {}};
  TRY(auto text, contentOf(path, kMostProgram + 1));
  if (text.size() > kMostProgram)
    return unreadableInput(path + ": has more than " + inMegabytes(kMostProgram) + ": check it in parts");
  return text;
}

// A cell, one of its tools and a program, as they were asked for.
struct Job {
  board::Cell cell;
  std::size_t asked{};  // place of the tool that was asked for
  std::vector<interference::Move> path;

  const board::CellTool& tool() const { return cell.tools[asked]; }
};

Outcome<Job, Trouble> jobOf(const Interference& options, Console& console) {
  if (options.cell == "-") return usage("--cell has to be a file: its solids may name others beside it");
  TRY(const auto text, contentOf(options.cell, board::kMostRead));
  auto cell = board::parseCell(text, std::filesystem::path{options.cell}.filename().string());
  if (!cell) return unreadableInput(cell.error().what);
  const auto tool = std::ranges::find(cell->tools, options.tool, &board::CellTool::number);
  if (tool == cell->tools.end())
    return usage(options.cell + " has no [[tool]] with number = " + std::to_string(options.tool) + ": add it");
  TRY(const auto program, programIn(options.program, console));
  auto path = interference::readProgram(program, interference::dialectOf(*cell, options.tool));
  if (!path) return Trouble{ExitStatus::usage, path.error().name, options.program + ": " + path.error().sentence()};
  for (auto& one : cell->tools) {
    if (options.stored) one.assembled_length_mm.reset(), one.w1_mm.reset();
  }
  const auto place = tool - cell->tools.begin();
  Job job{std::move(cell).value(), static_cast<std::size_t>(place), std::move(path).value()};
  return job;
}

std::string placeOf(const Pose& pose) {
  auto text = printed("X %.3f Y %.3f Z %.3f", pose.tip[0], pose.tip[1], pose.tip[2]);
  for (std::size_t k = 0; k < pose.angles_deg.size(); ++k) {
    if (pose.angles_deg[k] != 0) text += printed(" %c %.3f", "ABC"[k], pose.angles_deg[k]);
  }
  return text;
}

std::string line(const Hit& hit) {
  const auto how = hit.overlap_mm > 0             ? printed("%.3f mm deep", hit.overlap_mm)
                   : hit.nearest.distance_mm == 0 ? std::string{"touches"}
                                                  : printed("only %.3f mm away", hit.nearest.distance_mm);
  return printed("  line %zu: the ", hit.line) + std::string{interference::nameOf(hit.nearest.part)} +
         printed(" of tool %u and ", hit.tool) + hit.nearest.solid + ", " + how + ", tip at " + placeOf(hit.pose);
}

using Tools = std::vector<interference::Mounted>;

Json summary(const Job& job, const Tools& tools, const interference::Report& report) {
  Json hits = Json::array(), meshes = Json::array(), numbers = Json::array();
  for (const auto& hit : report.hits) hits.push_back(describe(hit));
  for (const auto& mesh : tools.front().scene->meshes())
    meshes.push_back({{"solid", mesh.solid}, {"size_mm", mesh.size_mm}, {"unit_stated", mesh.unit_stated}});
  for (const auto& one : tools) numbers.push_back(one.tool.number);
  const auto lengths = interference::lengthsOf(job.tool());
  return {{"cell", job.cell.name},
          {"tool", job.tool().number},
          {"tools", numbers},
          {"measured_lengths", lengths.measured},
          {"assembled_length_mm", lengths.assembled_mm},
          {"tip_from_axis_mm", lengths.tip_mm},
          {"meshes", meshes},
          {"moves", report.moves},
          {"path_mm", report.length_mm},
          {"least_allowed_mm", job.cell.least_mm},
          {"removed_mm3", report.removed_mm3},
          {"nearest", report.nearest ? describe(*report.nearest) : Json(nullptr)},
          {"hits", hits}};
}

void tellTools(const Job& job, const Tools& tools, Console& console) {
  for (const auto& [tool, scene] : tools) {
    const auto& lengths = scene->lengths();
    console.line(printed("tool %u, %s: %.4f mm beyond its holder, tip %+.4f %+.4f mm from the axis", tool.number,
                         lengths.measured ? "as measured" : "as in store", lengths.assembled_mm, lengths.tip_mm[0],
                         lengths.tip_mm[1]));
  }
  for (const auto& mesh : tools.front().scene->meshes())
    console.line(mesh.solid + printed(": %.3f x %.3f x %.3f mm, ", mesh.size_mm[0], mesh.size_mm[1], mesh.size_mm[2]) +
                 (mesh.unit_stated ? "in the unit that the cell states" : "if its STL is in mm"));
  const auto high = std::ranges::find_if(job.path, [](const interference::Move& move) {
    return move.from[2] == interference::kAbove_mm || move.to[2] == interference::kAbove_mm;
  });
  if (high != job.path.end())
    console.line(printed("line %zu: the reference point of Z is taken to be above everything", high->line));
}

void tell(const Job& job, const Tools& tools, const interference::Report& report, Console& console) {
  tellTools(job, tools, console);
  console.line(printed("%zu moves, %.1f mm, %.0f mm3 cut", report.moves, report.length_mm, report.removed_mm3));
  if (report.hits.empty() && report.nearest) {
    const auto& nearest = *report.nearest;
    console.line(printed("no hit; nearest %.3f mm: the ", nearest.nearest.distance_mm) +
                 std::string{interference::nameOf(nearest.nearest.part)} + " and " + nearest.nearest.solid +
                 printed(", line %zu", nearest.line));
  } else if (report.hits.empty()) {
    console.line("no hit");
  }
  if (!report.hits.empty())
    console.line(std::to_string(report.hits.size()) + (report.hits.size() == 1 ? " hit" : " hits"));
  for (std::size_t k = 0; k < std::min(kShown, report.hits.size()); ++k) console.line(line(report.hits[k]));
  if (report.hits.size() > kShown) console.line("  and so on; --json has all");
}

}  // namespace

Json describe(const Hit& hit) {
  return {{"line", hit.line},
          {"tool", hit.tool},
          {"solid", hit.nearest.solid},
          {"tool_part", std::string{interference::nameOf(hit.nearest.part)}},
          {"distance_mm", hit.nearest.distance_mm},
          {"overlap_mm", hit.overlap_mm},
          {"tip_mm", hit.pose.tip},
          {"angles_deg", hit.pose.angles_deg},
          {"on_tool_mm", hit.nearest.on_tool},
          {"on_solid_mm", hit.nearest.on_solid}};
}

ExitStatus run(const Interference& options, const std::string&, Console& console) {
  const auto job = jobOf(options, console);
  if (!job) return console.fail(job.error());
  const auto tools =
      interference::mount(job->cell, job->cell.tools, job->path, std::filesystem::path{options.cell}.parent_path());
  if (!tools) return console.fail(unreadableInput(tools.error().what));
  interference::Settings settings;
  settings.step_mm = options.step_mm;
  settings.stopped = [&console] { return console.interrupted(); };
  const auto report = interference::check(job->cell, *tools, job->path, settings);
  if (console.interrupted()) return ExitStatus::interrupted;
  if (console.json()) {
    console.object(summary(*job, *tools, report));
  } else {
    tell(*job, *tools, report, console);
  }
  return report.hits.empty() ? ExitStatus::ok : ExitStatus::failed;
}

}  // namespace probebox::command
