#include "tools/probebox/cli/output.hpp"
#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/commands/observed_box.hpp"

namespace probebox::command {

// Also where no box answers there is a file, which says so: an old one would go on to tell that all is well.
ExitStatus run(const Metrics& options, const std::string& uri, Console& console) {
  if (options.output == "-") console.keepOutputForData();
  const auto observe = [&]() -> Outcome<fleet::Observed, Trouble> {
    TRY(const auto box, openBox(uri, console));
    return observedBox(*box, console);
  };
  const auto seen = observe();
  fleet::Exposition exposition;
  fleet::addBox(exposition, seen ? &*seen : nullptr);
  auto output = Output::open(options.output, true, console.out());
  if (!output) return console.fail({ExitStatus::usage, std::string{kNotWritten}, output.error().what});
  if (!output->write(exposition.text()) || !output->finish())
    return console.fail({ExitStatus::usage, std::string{kNotWritten}, output->failure()});
  if (!seen) return console.fail(seen.error());
  if (console.json()) console.object({{"output", options.output}, {"series", exposition.series()}});
  return ExitStatus::ok;
}

}  // namespace probebox::command
