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

constexpr double kChord_mm = 0.005;  // by which chords leave an arc
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
  board::CellTool tool;
  std::vector<interference::Move> path;
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
  auto path = interference::readProgram(program, interference::dialectOf(*cell, options.tool, kChord_mm));
  if (!path) return unreadableInput(options.program + ": " + path.error().what);
  if (path->empty()) return unreadableInput(options.program + ": nothing moves in it once X, Y and Z are known");
  Job job{std::move(cell).value(), *tool, std::move(path).value()};
  if (options.stored) job.tool.assembled_length_mm.reset(), job.tool.w1_mm.reset();
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
  return printed("  line %zu: the ", hit.line) + std::string{interference::nameOf(hit.nearest.part)} + " and " +
         hit.nearest.solid + ", " + how + ", tip at " + placeOf(hit.pose);
}

Json summary(const Job& job, const interference::Lengths& lengths, const interference::Report& report) {
  Json hits = Json::array();
  for (const auto& hit : report.hits) hits.push_back(describe(hit));
  return {{"cell", job.cell.name},
          {"tool", job.tool.number},
          {"measured_lengths", lengths.measured},
          {"assembled_length_mm", lengths.assembled_mm},
          {"tip_from_axis_mm", lengths.tip_mm},
          {"moves", report.moves},
          {"path_mm", report.length_mm},
          {"least_allowed_mm", job.cell.least_mm},
          {"removed_mm3", report.removed_mm3},
          {"nearest", report.nearest ? describe(*report.nearest) : Json(nullptr)},
          {"hits", hits}};
}

void tell(const Job& job, const interference::Lengths& lengths, const interference::Report& report, Console& console) {
  console.line(printed("tool %u, %s: %.4f mm beyond its holder, tip %+.4f %+.4f mm from the axis", job.tool.number,
                       lengths.measured ? "as measured" : "as in store", lengths.assembled_mm, lengths.tip_mm[0],
                       lengths.tip_mm[1]));
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
  const auto scene = interference::Scene::open(interference::withoutStock(job->cell, job->path), job->tool,
                                               std::filesystem::path{options.cell}.parent_path());
  if (!scene) return console.fail(unreadableInput(scene.error().what));
  interference::Settings settings;
  settings.step_mm = options.step_mm;
  settings.stopped = [&console] { return console.interrupted(); };
  const auto report = interference::check(job->cell, job->tool, **scene, job->path, settings);
  if (console.interrupted()) return ExitStatus::interrupted;
  if (console.json()) {
    console.object(summary(*job, (*scene)->lengths(), report));
  } else {
    tell(*job, (*scene)->lengths(), report, console);
  }
  return report.hits.empty() ? ExitStatus::ok : ExitStatus::failed;
}

}  // namespace probebox::command
