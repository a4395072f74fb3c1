#include <filesystem>
#include <iterator>
#include <utility>
#include <vector>

#include "tools/probebox/cli/output.hpp"
#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/commands/kept_report.hpp"
#include "tools/probebox/commands/result_number.hpp"
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
    const EndsAtOnce while_it_computes{console_};
    auto found = report::subjectsIn(input);
    if (!found) return Trouble{ExitStatus::usage, "unreadable-input", found.error().what};
    return std::move(found).value();
  }

 private:
  Outcome<Subjects, Trouble> stored(const std::string& input) {
    // For each input anew: a box drops a host that is silent for as long as it takes to compute with a large dataset.
    const auto box = openBox(uri_, console_);
    if (!box) return notHere(input, box.error());
    auto id = resultNumber(input);
    if (!id) {
      TRY(const auto in_force, inForceAbout(**box, input));
      id = in_force;
    }
    TRY(auto subject, keptSubject(**box, console_, *id));
    Subjects subjects;
    subjects.push_back(std::move(subject));
    return subjects;
  }

  static Trouble notHere(const std::string& input, Trouble trouble) {
    trouble.what = "there is no case folder or file " + input + ", and results are on a box: " + trouble.what;
    return trouble;
  }

  Outcome<std::uint64_t, Trouble> inForceAbout(link::Client& box, const std::string& subject) {
    TRY(const auto all, keptInForce(box, console_));
    // Some subjects have the name of a method that answers another one too.
    for (const auto key : {&messages::ResultSummary::subject, &messages::ResultSummary::method}) {
      for (const auto& kept : all) {
        if (kept.summary.*key == subject) return kept.summary.id;
      }
    }
    return Trouble{ExitStatus::usage, "unreadable-input",
                   subject +
                       " is no case folder, no file and no number of a result, and no result about it is in "
                       "force; probebox results lists all"};
  }

  std::string uri_;
  Console& console_;
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
    if (console.interrupted()) return ExitStatus::interrupted;
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
