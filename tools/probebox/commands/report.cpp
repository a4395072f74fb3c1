#include <filesystem>
#include <iterator>
#include <limits>
#include <utility>
#include <vector>

#include "firmware/json/dataset_json.hpp"
#include "tools/probebox/cli/output.hpp"
#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/commands/kept_result.hpp"
#include "tools/probebox/commands/result_number.hpp"
#include "tools/probebox/link/stored_results.hpp"
#include "tools/probebox/text/report_kept_result.hpp"
#include "tools/report/page.hpp"
#include "tools/report/subjects.hpp"

namespace probebox::command {
namespace {

using Subjects = std::vector<report::Subject>;

// Finds what a report is about: on this disk, or among the results of a box, which is asked only when one is named.
class Inputs {
 public:
  Inputs(std::string uri, Console& console) : uri_{std::move(uri)}, console_{console} {}

  Outcome<Subjects, Trouble> about(const std::string& input) {
    std::error_code absent;
    const bool here = std::filesystem::exists(input, absent) || input.find('/') != std::string::npos;
    if (!here) return stored(input);
    auto found = report::subjectsIn(input);
    if (!found) return Trouble{ExitStatus::usage, "unreadable-input", found.error().what};
    return std::move(found).value();
  }

 private:
  Outcome<Subjects, Trouble> stored(const std::string& input) {
    if (!box_) {
      auto opened = openBox(uri_, console_);
      if (!opened) return notHere(input, opened.error());
      box_ = std::move(opened).value();
    }
    auto id = resultNumber(input);
    if (!id) {
      const auto in_force = inForceAbout(input);
      if (!in_force) return in_force.error();
      id = *in_force;
    }
    return ofResult(*id);
  }

  static Trouble notHere(const std::string& input, Trouble trouble) {
    trouble.what = "there is no case folder or file " + input + ", and results are on a box: " + trouble.what;
    return trouble;
  }

  Outcome<std::uint64_t, Trouble> inForceAbout(const std::string& subject) {
    const auto all = keptInForce(*box_, console_);
    if (!all) return all.error();
    for (const auto& kept : *all) {
      if (kept.summary.subject == subject || kept.summary.method == subject) return kept.summary.id;
    }
    return Trouble{ExitStatus::usage, "unreadable-input",
                   subject +
                       " is no case folder, no file and no number of a result, and no result about it is in "
                       "force; probebox results lists all"};
  }

  Outcome<Subjects, Trouble> ofResult(std::uint64_t id) {
    auto kept = keptResult(*box_, console_, id);
    if (!kept) return kept.error();
    const auto text = keptDataset(*box_, console_, id);
    if (!text) return text.error();
    auto dataset = json::datasetFromJson(*text);
    if (!dataset) {
      return Trouble{ExitStatus::failed, "unreadable-result",
                     "the dataset of result " + std::to_string(id) + " is not readable here (" + dataset.error().what +
                         "); update this command"};
    }
    auto before = beforeOf(kept->summary);
    if (!before) return before.error();
    const auto name = "result " + std::to_string(id) + ", " + standingOf(kept->summary);
    Subjects subjects{
        report::Subject{name, kept->summary.method, std::move(dataset).value(), std::move(kept->content)}};
    subjects.front().before = std::move(before).value();
    return subjects;
  }

  // The result in force and the earlier ones about the same subject, from the same probe, machine and mounting.
  Outcome<report::Before, Trouble> beforeOf(const messages::ResultSummary& summary) {
    constexpr std::size_t kEarlier = 9;  // the page shows the trend of ten
    const auto all = storedResults(*box_, console_, {}, std::numeric_limits<std::size_t>::max());
    if (!all) return all.error();
    report::Before before;
    std::vector<std::uint64_t> earlier;
    for (const auto& other : *all) {
      if (other.id == summary.id || !answersTheSame(other, summary)) continue;
      if (other.id < summary.id) earlier.push_back(other.id);
      if (other.state != messages::ResultState::active) continue;
      auto in_force = earlierOne(other.id);
      if (!in_force) return in_force.error();
      before.in_force = std::move(in_force).value();
    }
    if (earlier.size() > kEarlier) earlier.erase(earlier.begin(), earlier.end() - kEarlier);
    for (const auto id : earlier) {
      auto one = earlierOne(id);
      if (!one) return one.error();
      before.history.push_back(std::move(one).value());
    }
    return before;
  }

  Outcome<report::Earlier, Trouble> earlierOne(std::uint64_t id) {
    auto kept = keptResult(*box_, console_, id);
    if (!kept) return kept.error();
    return report::Earlier{"result " + std::to_string(id), kept->summary.proposed_utc,
                           std::get<metrology::Result>(std::move(kept->content))};
  }

  std::string uri_;
  Console& console_;
  Box box_;
};

ExitStatus write(const Report& options, const Subjects& subjects, Console& console) {
  auto output = Output::open(options.output, options.force, console.out());
  if (!output) return console.fail({ExitStatus::usage, "not-written", output.error().what});
  if (!output->write(report::page(subjects, PROBEBOX_VERSION)) || !output->finish()) {
    return console.fail({ExitStatus::usage, "not-written", output->failure()});
  }
  std::size_t refused = 0;
  for (const auto& subject : subjects) {
    if (subject.refusal() != nullptr) ++refused;
  }
  if (console.json()) {
    console.object({{"output", options.output}, {"answers", subjects.size() - refused}, {"refused", refused}});
  } else {
    console.line(options.output + ": " + std::to_string(subjects.size() - refused) + " solved, " +
                 std::to_string(refused) + " refused");
  }
  return refused > 0 ? ExitStatus::failed : ExitStatus::ok;
}

}  // namespace

// A refused case has its report too, and the exit status of a refusal.
ExitStatus run(const Report& options, const std::string& uri, Console& console) {
  if (options.output == "-") console.keepOutputForData();
  if (const auto objection = Output::objectionTo(options.output, options.force)) {
    return console.fail({ExitStatus::usage, "output-exists", *objection});
  }
  Subjects subjects;
  auto status = ExitStatus::ok;
  Inputs inputs{uri, console};
  for (const auto& input : options.inputs) {
    auto found = inputs.about(input);
    if (!found) {
      status = console.fail(found.error());
      continue;
    }
    subjects.insert(subjects.end(), std::make_move_iterator(found->begin()), std::make_move_iterator(found->end()));
  }
  if (subjects.empty()) return status;
  const auto written = write(options, subjects, console);
  return status != ExitStatus::ok ? status : written;
}

}  // namespace probebox::command
