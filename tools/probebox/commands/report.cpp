#include <filesystem>
#include <iterator>
#include <utility>
#include <vector>

#include "tools/probebox/cli/output.hpp"
#include "tools/probebox/commands/commands.hpp"
#include "tools/report/page.hpp"
#include "tools/report/subjects.hpp"

namespace probebox::command {

// A refused case has its report too, and the exit status of a refusal.
ExitStatus run(const Report& options, const std::string&, Console& console) {
  if (options.output == "-") console.keepOutputForData();
  if (const auto objection = Output::objectionTo(options.output, options.force)) {
    return console.fail({ExitStatus::usage, "output-exists", *objection});
  }
  std::vector<report::Subject> subjects;
  auto status = ExitStatus::ok;
  for (const auto& input : options.inputs) {
    auto found = report::subjectsIn(input);
    if (!found) {
      status = console.fail({ExitStatus::usage, "unreadable-input", found.error().what});
      continue;
    }
    subjects.insert(subjects.end(), std::make_move_iterator(found->begin()), std::make_move_iterator(found->end()));
  }
  if (subjects.empty()) return status;
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
  if (status != ExitStatus::ok) return status;
  return refused > 0 ? ExitStatus::failed : ExitStatus::ok;
}

}  // namespace probebox::command
