#include "tools/report/certificate.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "board/describe/file_content.hpp"
#include "board/describe/parties.hpp"
#include "firmware/json/dataset_json.hpp"
#include "tools/probebox/cli/output.hpp"
#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/commands/kept_report.hpp"
#include "tools/probebox/commands/kept_result.hpp"
#include "tools/probebox/link/stored_results.hpp"
#include "tools/probebox/text/report_kept_result.hpp"
#include "tools/probebox/text/report_unit.hpp"
#include "tools/report/dcc.hpp"

namespace probebox::command {
namespace {

struct Certified {
  report::Subject subject;
  report::CertificateFacts facts;
};

std::string boxInWords(const messages::Descriptor& descriptor, const messages::DescribeUnit::Answer* unit) {
  const bool named = unit != nullptr && unit->provisioned && unit->in_use;
  return (named ? unit->vendor + " " + unit->model : "probebox, board " + descriptor.board) + ", " +
         descriptor.serial_number;
}

// The day on which the days of machine.toml's [[requirement]] are over, of a result in force; empty without one.
std::string dayBySchedule(std::uint64_t id, link::Client& box, Console& console) {
  const auto status = ask<messages::Status>(box, console);
  if (!status) return "";
  const auto due = std::ranges::find(status->due, id, &published::Due::result_id);
  return due == status->due.end() ? "" : due->due_utc.substr(0, due->due_utc.find('T'));
}

Outcome<Certified, Trouble> certified(const Certificate& options, link::Client& box, Console& console) {
  TRY(auto kept, keptResult(box, console, options.id));
  const auto id = std::to_string(options.id);
  if (kept.result() == nullptr)
    return Trouble{
        ExitStatus::failed, "refused-result",
        "result " + id + " is a refusal, of which there is no certificate; probebox show " + id + " says why"};
  Certified all{{"result " + id + ", " + standingOf(kept.summary), kept.summary.method, {}, *kept.result()}, {}};
  all.subject.about = kept.summary.subject;
  std::string dataset_text;
  if (kept.dataset_kept) {
    TRY(dataset_text, keptDataset(box, console, options.id));
  }
  const auto unit = ask<messages::DescribeUnit>(box, console);
  const auto& descriptor = box.described();
  auto& facts = all.facts;
  facts = {.number = descriptor.serial_number + "-" + id,
           .subject = kept.summary.subject,
           .box = boxInWords(descriptor, unit ? &*unit : nullptr),
           .firmware = descriptor.firmware_version,
           .probe = kept.summary.probe,
           .machine = kept.summary.machine,
           .mounting = kept.summary.mounting,
           .stored_utc = kept.summary.proposed_utc,
           .accepted = kept.summary.accepted_by.empty()
                           ? ""
                           : "by " + kept.summary.accepted_by + ", " + kept.summary.accepted_utc,
           .issued_utc = nowUtc(),
           .issued_by = options.by,
           .next_due = options.next_due};
  TRY(const auto listed, storedResults(box, console, {}, std::numeric_limits<std::size_t>::max()));
  if (facts.next_due.empty()) facts.next_due = dayBySchedule(options.id, box, console);
  if (const auto own = std::ranges::find(listed, options.id, &messages::ResultSummary::id); own != listed.end()) {
    addWhatItRestsOn(all.subject, *own);
    all.subject.conformity = conformityOf(*own, requirementsOf(box, console));
    TRY(all.subject.before.in_force, acceptedBefore(box, console, *own, listed));
  }
  // Behind all questions: reading a large dataset takes longer than the box waits for a silent host.
  if (auto dataset = json::datasetFromJson(dataset_text)) all.subject.dataset = std::move(dataset).value();
  return all;
}

}  // namespace

ExitStatus run(const Certificate& options, const std::string& uri, Console& console) {
  if (options.output == "-") console.keepOutputForData();
  if (const auto objection = Output::objectionTo(options.output, options.force))
    return console.fail({ExitStatus::usage, "output-exists", *objection});
  if (!options.next_due.empty() && today() != kNoDate && options.next_due < today())
    return console.fail(
        {ExitStatus::usage, "past-day", "--next-due " + options.next_due + " is over: name a day to come"});
  std::optional<board::Parties> parties;
  const auto& file = options.dcc.empty() ? options.laboratory : options.dcc;
  if (!file.empty()) {
    auto text = board::fileContent(file);
    if (!text) return console.fail({ExitStatus::usage, "not-read", file + ": " + text.error().what});
    auto read = board::parseParties(*text, file);
    if (!read) return console.fail({ExitStatus::usage, "not-read", read.error().what});
    parties = std::move(*read);
  }
  const auto box = openBox(uri, console);
  if (!box) return console.fail(box.error());
  const auto all = certified(options, **box, console);
  if (!all) return console.fail(all.error());
  auto document = !options.dcc.empty()
                      ? report::dccDocument(all->subject, all->facts, *parties, PROBEBOX_VERSION)
                      : Outcome<std::string>{report::certificatePage(all->subject, all->facts, PROBEBOX_VERSION,
                                                                     parties ? &*parties : nullptr)};
  if (!document) return console.fail({ExitStatus::failed, "no-dcc", document.error().what});
  auto output = Output::open(options.output, options.force, console.out());
  if (!output) return console.fail({ExitStatus::usage, "not-written", output.error().what});
  if (!output->write(*document) || !output->finish())
    return console.fail({ExitStatus::usage, "not-written", output->failure()});
  const auto why = report::whyNotTraceable(*all->subject.result(), all->facts);
  if (console.json())
    console.object({{"output", options.output},
                    {"certificate", all->facts.number},
                    {"result_id", options.id},
                    {"traceable", !why.has_value()},
                    {"why_not_traceable", why ? Json(*why) : Json(nullptr)}});
  else
    console.line(options.output + ": certificate " + all->facts.number + (why ? ", not traceable" : ", traceable"));
  return ExitStatus::ok;
}

}  // namespace probebox::command
