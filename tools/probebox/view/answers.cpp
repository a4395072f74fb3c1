#include "tools/probebox/view/answers.hpp"

#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "firmware/procedure/methods/methods.hpp"
#include "protocol/units/angle.hpp"
#include "tools/case/quantities.hpp"
#include "tools/case/readable.hpp"
#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/commands/kept_report.hpp"
#include "tools/probebox/commands/kept_result.hpp"
#include "tools/probebox/commands/planned_machine.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/link/stored_results.hpp"
#include "tools/probebox/text/comparison.hpp"
#include "tools/probebox/text/machine_verdict.hpp"
#include "tools/probebox/text/report.hpp"
#include "tools/probebox/text/report_kept_result.hpp"
#include "tools/probebox/text/subject_words.hpp"
#include "tools/probebox/view/page_request.hpp"
#include "tools/report/page.hpp"

namespace probebox::view {
namespace {

using command::describe;
using command::ExitStatus;
using command::groupOf;
using command::methodTitle;
using command::subjectTitle;
using Answer = BoxConnection::Answer;

// Texts of methods are written for a page of documents and for the command: here they have neither marks nor options.
std::string forPage(std::string_view text) {
  std::string all{text};
  for (auto begin = all.find(" (`--"); begin != std::string::npos; begin = all.find(" (`--", begin)) {
    const auto end = all.find(')', begin);
    if (end == std::string::npos) break;
    all.erase(begin, end + 1 - begin);
  }
  for (const std::string_view mark : {"`--", "`"})
    for (auto at = all.find(mark); at != std::string::npos; at = all.find(mark, at)) all.erase(at, mark.size());
  return casefolder::typeset(all);
}

// "tau machine" for tau_machine: where no file is told of, an underscore says nothing to a person.
std::string inWords(std::string_view text) {
  auto all = forPage(text);
  for (std::size_t k = 1; k + 1 < all.size(); ++k)
    if (all[k] == '_' && all[k - 1] != ' ' && all[k + 1] != ' ') all[k] = ' ';
  return all;
}

Json list(const auto& texts) {
  Json all = Json::array();
  for (const auto& text : texts) all.push_back(inWords(std::string_view{text}));
  return all;
}

Json needsOf(const procedure::LiveMethod& method) {
  Json all = Json::array();
  for (const auto* fact : method.needs) {
    if (!fact->place.empty()) all.push_back(forPage(fact->place));
  }
  if (method.finds_a_place) all.push_back("the delay in force, and axes that are referenced");
  return all;
}

// The options that have an effect, with their usual values. Zero is the method's own choice.
Json optionsOf(const procedure::LiveMethod& method) {
  const auto& usual = method.usual;
  Json all = Json::object();
  if (usual.speed_count > 0 && method.kind == procedure::Kind::touch) {
    Json speeds = Json::array();
    for (std::size_t k = 0; k < usual.speed_count; ++k) speeds.push_back(usual.speeds_mm_s[k]);
    all["speeds_mm_s"] = speeds;
  }
  const auto add = [&](const char* name, double value) {
    if (value != 0) all[name] = value;
  };
  add("overtravel_mm", usual.overtravel_mm);
  add("clearance_mm", usual.clearance_mm);
  add("approach_deg", degrees(usual.approach_rad));
  add("arc_deg", degrees(usual.arc_rad));
  add("angles", usual.angles);
  add("balls", usual.balls);
  if (method.takes_tool) all["tool"] = 1;
  if (method.takes_axis) all["axis"] = "X";
  if (method.measuresBOrC()) all["axis"] = "C";
  return all;
}

// A forecast as the command has it, with its values set for a page.
std::string forPage(nlohmann::json plan) {
  for (auto& quantity : plan["quantities"]) {
    for (auto& text : quantity)
      if (text.is_string()) text = casefolder::typeset(text.get<std::string>());
  }
  return plan.dump();
}

Json quantitiesOf(const metrology::Result& result, const std::string& subject) {
  Json all = Json::array();
  for (const auto& quantity : casefolder::quantitiesOf(result, casefolder::rotaryAxisOf(subject))) {
    const auto sd = quantity.sd ? Json(*quantity.sd) : Json(nullptr);
    const auto expanded = quantity.expanded ? Json(*quantity.expanded) : Json(nullptr);
    all.push_back({{"key", quantity.key},
                   {"name", casefolder::typeset(quantity.label.name)},
                   {"value", quantity.value},
                   {"sd", sd},
                   {"u", quantity.expanded ? Json(*quantity.expanded / 2) : Json(nullptr)},
                   {"expanded_k2", expanded},
                   {"text", casefolder::typeset(casefolder::withSdAndU(quantity))}});
  }
  return all;
}

// "deviations" of the keys that begin with "deviation_".
std::string nameOf(std::string_view key) {
  if (key.ends_with('_')) return std::string{key.substr(0, key.size() - 1)} + "s";
  return casefolder::quantityLabel(std::string{key}).name;
}

// Adds its decisive value, and returns that.
std::optional<command::DecisiveValue> addDecisive(const messages::ResultSummary& summary,
                                                  const std::vector<messages::Requirement>& requirements,
                                                  Json& object) {
  auto decisive = command::decisiveValue(summary, command::requirementOf(requirements, summary.subject));
  object["decisive"] = decisive ? describe(*decisive) : Json(nullptr);
  return decisive;
}

// Adds as well how that went in the last results about the same.
void addJudgement(const messages::ResultSummary& summary, const std::vector<messages::ResultSummary>& all,
                  const std::vector<messages::Requirement>& requirements, Json& object) {
  const auto decisive = addDecisive(summary, requirements, object);
  object["trend"] = decisive ? describe(command::trendOf(summary, *decisive, all)) : Json(nullptr);
}

// With the words that a page has for it.
Json titled(const messages::ResultSummary& summary) {
  Json object = describe(summary);
  object["standing"] = command::standingOf(summary);
  object["title"] = subjectTitle(summary.subject);
  object["method_title"] = methodTitle(summary.method);
  return object;
}

template <class Operation>
Answer changed(link::Client& box, Console& console, const typename Operation::Request& request) {
  TRY(command::ask<Operation>(box, console, request));
  return Json{{"done", true}}.dump();
}

}  // namespace

std::string methods() {
  Json all = Json::array();
  for (const auto* method : procedure::liveMethods()) {
    const auto& subject = method->solver->subject.about;
    Json finds = Json::array();
    for (const auto& result : method->solver->results)
      finds.push_back({{"name", nameOf(result.key)}, {"about", inWords(result.about)}});
    all.push_back({{"name", std::string{method->name()}},
                   {"title", std::string{method->solver->title}},
                   {"subject", subject ? text(*subject) : std::string{}},
                   {"group", groupOf(*method->solver)},
                   {"steps", inWords(method->steps)},
                   {"finds", finds},
                   {"unobservable", list(method->solver->unobservable)},
                   {"needs", needsOf(*method)},
                   {"calibrates", method->calibrates},
                   {"options", optionsOf(*method)}});
  }
  return all.dump();
}

std::optional<command::AskedBox> machineOf(BoxConnection& connection) {
  std::optional<command::AskedBox> asked;
  const auto answer = connection.ask([&asked](link::Client& box, Console& console) -> Answer {
    TRY(auto says, command::ask<messages::DescribeMachine>(box, console));
    asked = command::AskedBox{.uri = "of this page", .says = std::move(says)};
    return std::string{};
  });
  return answer ? asked : std::nullopt;
}

Answer stores(link::Client& box, Console& console) {
  TRY(const auto says, command::ask<messages::DescribeMachine>(box, console));
  Json all = Json::array();
  for (const auto& tool : says.tools) {
    if (tool.holder == 0 || !(tool.length_mm > tool.holder_length_mm)) continue;
    all.push_back({{"number", tool.number},
                   {"holder_length_mm", tool.holder_length_mm},
                   {"length_mm", tool.length_mm - tool.holder_length_mm}});
  }
  return all.dump();
}

// As `probebox plan --json` says it, its values set for a page.
Answer forecast(const std::string& method, const std::optional<command::AskedBox>& box) {
  std::istringstream nothing;
  std::ostringstream out, err;
  const std::atomic<bool> never{false};
  Console console{command::Streams{nothing, out, err, false, false, 0, never}, true};
  command::Plan plan;
  plan.method = method;
  const auto status = command::planFor(plan, box, console);
  if (status == ExitStatus::ok) return forPage(nlohmann::json::parse(out.str(), nullptr, false));
  const auto error = nlohmann::json::parse(out.str(), nullptr, false);
  return Trouble{status, "no-forecast",
                 error.is_object() && error.contains("what") ? error["what"].get<std::string>() : err.str()};
}

Answer results(link::Client& box, Console& console) {
  TRY(const auto all, command::storedResults(box, console, {}, std::numeric_limits<std::size_t>::max()));
  const auto requirements = command::requirementsOf(box, console);
  Json list = Json::array();
  for (const auto& one : all) {
    Json object = titled(one);
    addDecisive(one, requirements, object);
    list.push_back(std::move(object));
  }
  return list.dump();
}

Answer result(link::Client& box, Console& console, std::uint64_t id) {
  TRY(const auto kept, command::keptResult(box, console, id));
  Json object = titled(kept.summary);
  object["dataset_kept"] = kept.dataset_kept;
  if (kept.result() != nullptr) {
    object["warnings"] = list(kept.result()->warnings);
    object["quantities"] = quantitiesOf(*kept.result(), kept.summary.subject);
  } else {
    object["refusal"] = {{"name", kept.refusal()->name}, {"reason", kept.refusal()->reason}};
  }
  TRY(const auto all, command::storedResults(box, console, {}, std::numeric_limits<std::size_t>::max()));
  const auto found = std::ranges::find(all, id, &messages::ResultSummary::id);
  if (found != all.end()) addJudgement(*found, all, command::requirementsOf(box, console), object);
  TRY(const auto history, command::storedTransitions(box, console, {id, "", 0}));
  object["history"] = Json::array();
  for (const auto& transition : history) object["history"].push_back(describe(transition));
  return object.dump();
}

Answer history(link::Client& box, Console& console, const std::string& subject) {
  TRY(const auto all, command::storedTransitions(box, console, {0, subject, 0}));
  Json list = Json::array();
  for (const auto& transition : all) list.push_back(describe(transition));
  return list.dump();
}

Answer comparison(link::Client& box, Console& console, std::uint64_t id) {
  TRY(const auto proposed, command::keptResult(box, console, id));
  if (proposed.result() == nullptr) return std::string{"null"};
  const auto& subject = proposed.summary.subject;
  const auto by_box = command::comparisonByBox(box, console, proposed);
  const auto compared = by_box ? *by_box : command::nothingBeside(*proposed.result(), subject);
  Json object = describe(compared);
  Json changes = Json::array();
  for (const auto& change : compared.changes) {
    const auto in_sd = change.inSd();
    changes.push_back(
        {{"key", change.now.key},
         {"name", casefolder::typeset(change.now.label.name)},
         {"now", casefolder::typeset(casefolder::withSdAndU(change.now))},
         {"before", change.before ? Json(casefolder::typeset(casefolder::withSdAndU(*change.before))) : Json(nullptr)},
         {"difference", change.before ? Json(casefolder::typeset(command::differenceText(change))) : Json(nullptr)},
         {"in_sd", in_sd ? Json(*in_sd) : Json(nullptr)}});
  }
  object["rows"] = changes;
  object["subject"] = subject;
  object["title"] = subjectTitle(subject);
  return object.dump();
}

Answer reportPage(link::Client& box, Console& console, std::uint64_t id) {
  TRY(const auto subject, command::keptSubject(box, console, id));
  return report::page(std::span{&subject, 1}, PROBEBOX_VERSION);
}

Answer start(link::Client& box, Console& console, const std::string& body) {
  PageRequest asked{body};
  messages::StartProcedure::Request request;
  request.method = asked.text("method");
  const auto speeds_mm_s = asked.numbers("speeds_mm_s");
  if (speeds_mm_s.size() > kMostSpeeds)
    return Trouble{ExitStatus::usage, "usage", "a run has up to " + std::to_string(kMostSpeeds) + " speeds: omit some"};
  auto& options = request.options;
  options.speed_count = static_cast<std::uint8_t>(speeds_mm_s.size());
  std::ranges::copy(speeds_mm_s, options.speeds_mm_s.begin());
  options.overtravel_mm = asked.number("overtravel_mm");
  options.clearance_mm = asked.number("clearance_mm");
  options.approach_rad = asked.number("approach_deg") * kDegree;
  options.arc_rad = asked.number("arc_deg") * kDegree;
  options.angles = asked.count<std::uint16_t>("angles");
  options.balls = asked.count<std::uint16_t>("balls");
  options.axis = asked.axis();
  options.tool = asked.count<std::uint32_t>("tool");
  if (auto trouble = asked.trouble()) return *trouble;
  TRY(const auto answer, command::ask<messages::StartProcedure>(box, console, request));
  return Json{{"run", answer.run}}.dump();
}

Answer abortRun(link::Client& box, Console& console, const std::string& body) {
  PageRequest asked{body};
  messages::AbortProcedure::Request request;
  request.run = asked.count<std::uint32_t>("run");
  if (auto trouble = asked.trouble()) return *trouble;
  return changed<messages::AbortProcedure>(box, console, request);
}

// A person who moves the machine by hand says when a step begins and ends: the one that the page shows, which another
// hand may have ended meanwhile.
Answer mark(link::Client& box, Console& console, const std::string& body) {
  PageRequest asked{body};
  const auto phase = asked.text("phase");
  const auto run = asked.count<std::uint32_t>("run");
  const auto step = asked.count<std::uint32_t>("step");
  if (auto trouble = asked.trouble()) return *trouble;
  messages::PostMarker::Request request;
  if (phase == "begin") {
    request.phase = messages::StepPhase::begin;
  } else if (phase == "end") {
    request.phase = messages::StepPhase::end;
  } else if (phase == "abandon") {
    request.phase = messages::StepPhase::abandon;
  } else {
    return Trouble{ExitStatus::usage, "refused", "phase has to be begin, end or abandon"};
  }
  TRY(const auto now, command::ask<messages::ProcedureStatus>(box, console));
  if (now.run != run || now.step != step)
    return Trouble{ExitStatus::failed, "not-now",
                   "the box is at step " + std::to_string(now.step + 1) + " of run " + std::to_string(now.run) +
                       " by now: look at the step and press again"};
  request.procedure = now.run;
  request.step = now.step;
  request.rotary_angles_rad = now.rotary_angles_rad;
  request.tool = now.tool;
  request.nominal_speed_mm_s = now.nominal_speed_mm_s;
  request.at_rest = request.phase == messages::StepPhase::begin;
  return changed<messages::PostMarker>(box, console, request);
}

Answer accept(link::Client& box, Console& console, const std::string& body) {
  PageRequest asked{body};
  messages::AcceptResult::Request request;
  request.id = asked.count<std::uint64_t>("id");
  request.by = asked.text("by");
  request.although_it_differs = asked.flag("although_it_differs");
  if (auto trouble = asked.trouble()) return *trouble;
  TRY(const auto answer, command::ask<messages::AcceptResult>(box, console, request));
  return Json{{"state", std::string{messages::nameOf(answer.state)}},
              {"waiting_for_cut", answer.waiting_for_cut},
              {"subject", answer.subject},
              {"notes", answer.notes}}
      .dump();
}

Answer rollback(link::Client& box, Console& console, const std::string& body) {
  PageRequest asked{body};
  messages::RollbackResult::Request request;
  request.id = asked.count<std::uint64_t>("id");
  request.by = asked.text("by");
  if (auto trouble = asked.trouble()) return *trouble;
  return changed<messages::RollbackResult>(box, console, request);
}

}  // namespace probebox::view
