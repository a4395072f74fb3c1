#include "tools/report/certificate.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string_view>

#include "firmware/metrology/dataset/conditions.hpp"
#include "firmware/metrology/dataset/quantity.hpp"
#include "firmware/metrology/methods.hpp"
#include "firmware/metrology/rotary/rotary_axis_errors.hpp"
#include "firmware/metrology/tilt/pivot.hpp"
#include "protocol/units/calendar.hpp"
#include "tools/case/quantities.hpp"
#include "tools/case/readable.hpp"
#include "tools/report/change.hpp"
#include "tools/report/conformity.hpp"
#include "tools/report/coverage.hpp"
#include "tools/report/decision.hpp"
#include "tools/report/document_head.hpp"
#include "tools/report/html.hpp"
#include "tools/report/names.hpp"
#include "tools/report/sections.hpp"

namespace probebox::report {
namespace {

struct Measurand {
  SubjectKind kind;
  std::string_view sentence;
};

// docs/results.md, Subject and binding. A is the angle of the spindle that carries the probe, C the turning axis.
constexpr auto kMeasurands = std::to_array<Measurand>({
    {SubjectKind::delay,
     "the time by which the stamps of the machine's positions are later than those of the probe's deflections, per "
     "axis; the "
     "gain turns deflections into machine axes with the spindle at A = 0, if the case states at which A it was "
     "measured"},
    {SubjectKind::centreline,
     "the position of the turning axis C relative to the axis of the spindle that carries the probe; where a turret "
     "carries it, relative to the tip of the stylus, in X alone"},
    {SubjectKind::centreline_tip,
     "the position of the turning axis C relative to the tip of the stylus with the spindle at A = 0: the offset of "
     "the tip from the axis of "
     "the spindle is part of it"},
    {SubjectKind::centreline_slide,
     "the position of the turning axis C of a chuck that the Z slide carries, relative to the axis of the spindle that "
     "carries the probe"},
    {SubjectKind::stylus_offset,
     "the position of the tip of the stylus relative to the axis of the spindle that carries it, at A = 0"},
    {SubjectKind::spindle_offset, "the turning axis C minus the axis of the spindle that carries the probe"},
    {SubjectKind::spindle_tilt, "the tilt against Z of the axis of the spindle that carries the probe"},
    {SubjectKind::swivel,
     "the displacement of the reported centre of a ball when the head swivels, relative to the upright head"},
    {SubjectKind::rotary,
     "the deviations of a rotary axis about the point named here, relative to the axis at angle zero, and what they "
     "consist of: its location and orientation, and its error motions (ISO 230-1, ISO 230-7)"},
    {SubjectKind::screw,
     "the extension of a ball screw by its sensor: gain, and the error of the measured face by sector"},
    {SubjectKind::screw_reference, "the reading of the sensor that means no extension"},
    {SubjectKind::tool, "the position of the tip of a tool relative to the reference of the head"},
    {SubjectKind::setter, "the position of the tool-setting device"},
    {SubjectKind::assembly, "the length and the offset of a tool in its holder"},
    {SubjectKind::sensor_head,
     "the matrix that turns the readings of a sensor head into machine axes, and its readings at the centre"},
    {SubjectKind::check, "the errors that a ball shows at different angles of the axes, against its accepted place"},
});

namespace quantity = metrology::quantity;

using metrology::Estimate;
using metrology::Result;

// Each printed page says which of how many it is.
constexpr std::string_view kPageNumbers =
    "@page { @bottom-right { content: \"page \" counter(page) \" of \" counter(pages); font: 9pt sans-serif; } }";
constexpr std::size_t kMostCertified = 600;  // rows; a page nobody reads is no certificate

// The day of the sphere's calibration, as CalibratedSphere::inWords() has it: "..., 2026-04-17: sphere ...".
std::string certifiedDay(const Result& result) {
  constexpr std::size_t kDay = 10;
  const auto words = conditionOf(result, "sphere_certificate");
  const auto end = words.rfind(": sphere ");
  if (end == std::string::npos || end < kDay) return "";
  const auto day = words.substr(end - kDay, kDay);
  return dayOf(day) ? day : "";
}

std::string factRow(const std::string& name, const std::string& value) {
  return "<tr>" + element("td", name) + element("td", value) + "</tr>\n";
}

std::string percent(double probability) {
  std::array<char, 16> text{};
  std::snprintf(text.data(), text.size(), "%.1f %%", 100 * probability);
  return text.data();
}

// How much of u squared comes from the diameter of the sphere; nothing where no certificate is on record for it.
std::string shareOfSphere(const Result& result, const Estimate& estimate, std::size_t k, double u) {
  if (conditionOf(result, "sphere_certificate").empty()) return "";
  std::size_t at = k;
  for (const auto& before : result.estimates) {
    if (&before == &estimate) break;
    at += before.values.size();
  }
  const auto sphere = std::ranges::find(result.budget, "sd_effective_diameter_mm", &metrology::Contribution::name);
  if (sphere == result.budget.end() || at >= sphere->sd.size()) return percent(0);
  return percent(sphere->sd[at] * sphere->sd[at] / (u * u));
}

std::string certifiedRow(const Subject& subject, const Estimate& estimate, std::size_t k) {
  const auto unit = unitOf(estimate, k);
  const auto u = combinedOf(estimate, k);
  const auto cell = [](const std::string& text) { return "<td class=\"n\">" + escaped(text) + "</td>"; };
  std::string row = "<tr>" + element("td", valueName(subject, estimate, k)) +
                    cell(valueDigits(unit, estimate.values[k], u)) + element("td", unit.unit);
  if (!u || !(*u > 0))
    return row + cell("unknown") + cell("") + cell("unknown") + cell("") + cell("") + cell("") + "</tr>\n";
  const double dof = effectiveDof(*subject.result(), estimate, k);
  return row + cell(casefolder::withUnit({unit.name, "", unit.factor}, *u)) + cell("2") +
         cell(uncertaintyDigits(unit, *u)) + cell(dofText(dof)) +
         cell(percent(coverageOf(*subject.result(), estimate, k, kCoverageFactor))) +
         cell(shareOfSphere(*subject.result(), estimate, k, *u)) + "</tr>\n";
}

// Where the values hold, and what they are of: without it a centre on an inclined axis is no measurand.
std::string placesTable(const Subject& subject, const CertificateFacts& facts) {
  std::string rows;
  for (const auto& estimate : subject.result()->also) {
    if (!isPlace(estimate)) continue;
    for (std::size_t k = 0; k < estimate.values.size(); ++k) {
      const auto unit = unitOf(estimate, k);
      rows += factRow(valueName(subject, estimate, k),
                      valueDigits(unit, estimate.values[k], combinedOf(estimate, k)) + " " + unit.unit);
    }
  }
  if (const auto what = measurandOf(facts.subject); !what.empty())
    rows = factRow("measurand", std::string{what}) + rows;
  return rows.empty() ? "" : "<table>\n" + rows + "</table>\n";
}

std::string resultTable(const Subject& subject, const CertificateFacts& facts) {
  const auto names = casefolder::axisNamesInWords(*subject.result(), axisLetter(subject));
  std::string text =
      "<h2>Result</h2>\n" + (names.empty() ? "" : "<p class=\"small\">" + escaped(names) + "</p>\n") +
      "<table class=\"values matrix\">\n<thead><tr><th>measurand</th><th class=\"n\">measured "
      "value</th>"
      "<th>unit</th><th class=\"n\">standard uncertainty u</th><th class=\"n\">coverage factor k</th>"
      "<th class=\"n\">expanded uncertainty U</th><th class=\"n\">effective degrees of freedom \u03bd_eff</th>"
      "<th class=\"n\">coverage probability</th><th class=\"n\">of u\u00b2, the sphere's "
      "certificate</th></tr></thead>\n<tbody>\n";
  std::size_t rows = 0, all = 0;
  std::string zero;
  for (const auto& estimate : subject.result()->estimates) {
    for (std::size_t k = 0; k < estimate.values.size(); ++k) {
      if (casefolder::zeroByDefinition(estimate, k)) {
        zero += (zero.empty() ? "" : ", ") + valueName(subject, estimate, k);
        continue;
      }
      if (++all > kMostCertified) continue;
      ++rows;
      text += certifiedRow(subject, estimate, k);
    }
  }
  text += "</tbody></table>\n";
  if (rows < all)
    text += "<p class=\"small\">The first " + std::to_string(rows) + " of " + std::to_string(all) + " values.</p>\n";
  if (!zero.empty()) text += "<p class=\"small\">" + escaped("Zero by definition: " + zero + ".") + "</p>\n";
  text += placesTable(subject, facts);
  if (const auto& convention = subject.result()->convention; !convention.empty())
    text += "<p class=\"small\">" + escaped(convention) + "</p>\n";
  return text +
         "<p class=\"small\">u is the combined standard measurement uncertainty; U = k u. The effective degrees of "
         "freedom "
         "\u03bd_eff of u are those of JCGM 100:2008, G.4 (Welch-Satterthwaite): type A with those of the sd of the "
         "readings, here " +
         dofText(readingsDof(*subject.result())) +
         ", type B with infinitely many. The fit itself has \u03bd = " + std::to_string(subject.result()->dof) +
         ", its readings minus its unknowns. The coverage probability is that of Student's t; u of type A by residuals "
         "is "
         "its standard deviation, s sqrt(n/(n - 2)) at n degrees of freedom.</p>\n";
}

// Box at the top of a certificate with the answer of the decision rule for values that have limits. Empty for other
// results.
std::string verdictBox(const Subject& subject) {
  if (verdictOn(subject))
    return decisionBox(subject, {"Decision rule: ISO 14253-1 with U (k = 2) as guard band, below."});
  if (!subject.conformity) return "";
  return decisionBox(subject,
                     {subject.conformity->is_deviation
                          ? decisionRule() + " The limit is the one that the user of the machine states."
                          : "Decision rule: U (k = 2) is at most the limit that the user of the machine states."});
}

// True where nobody has stated how uncertain the diameter of the stylus ball is.
bool ballIsAssumed(const Result& result) {
  return conditionOf(result, metrology::kStylusBall).ends_with(metrology::kAssumedExact);
}

// The stylus ball, as far as the values rely on its diameter.
std::string stylusBall(const Result& result) {
  const auto stated = conditionOf(result, metrology::kStylusBall);
  if (!stated.empty()) return stated;
  constexpr std::array<std::string_view, 4> kSizes{quantity::kEffectiveDiameter.key, "effective_ball_radius_mm",
                                                   "stylus_ball_radius_mm", "stylus_ball_diameter_mm"};
  const auto* method = metrology::methodNamed(result.method);
  const auto isSize = [&](const metrology::MethodKey& key) {
    return std::ranges::find(kSizes, key.name) != kSizes.end();
  };
  return method != nullptr && std::ranges::none_of(method->keys, isSize)
             ? "the values do not rely on its diameter"
             : "not on record: whether its sd is stated or assumed is not known";
}

std::string traceabilityBox(const Subject& subject, const CertificateFacts& facts) {
  const Result& result = *subject.result();
  const auto why = whyNotTraceable(result, facts);
  std::string text = why ? "<div class=\"verdict failed\"><p>NOT TRACEABLE</p><ul>" + element("li", *why)
                         : "<div class=\"verdict neutral\"><p>Traceable to the certificate of the reference sphere, as "
                           "far as u rests on it</p><ul>" +
                               element("li", conditionOf(result, "sphere_certificate"));
  for (const auto& sentence : reservationsAbout(subject, facts)) text += element("li", sentence);
  if (!result.warnings.empty()) text += element("li", std::to_string(result.warnings.size()) + " warnings, below.");
  return text + "</ul></div>\n";
}

std::string traceabilityTable(const Result& result) {
  const auto sphere = conditionOf(result, "sphere_certificate");
  const auto due = conditionOf(result, "sphere_next_due");
  return "<h2>Metrological traceability</h2>\n<table>\n" +
         factRow("reference", sphere.empty() ? "none with a certificate on record" : sphere) +
         factRow("its next calibration", due.empty() ? "not known" : due) + factRow("stylus ball", stylusBall(result)) +
         factRow("scales and clock",
                 "the encoders of the machine and the clock of the box have no certificate on record; the values rely "
                 "on them") +
         "</table>\n";
}

std::string orNotStated(const std::string& text) {
  return text.empty() ? "not stated" : text;
}

std::string circumstances(const Subject& subject, const CertificateFacts& facts) {
  const Result& result = *subject.result();
  const auto temperature = conditionOf(result, "temperature_c");
  std::string text = "<h2>Conditions of the measurement</h2>\n<table>\n" + factRow("machine", facts.machine) +
                     factRow("probe", facts.probe + ", " + facts.mounting) + factRow("measured with", facts.box) +
                     factRow("measured", measuredUtc(result, facts)) +
                     factRow("temperature", temperature.empty() ? "not stated" : temperature + " \u00b0C") +
                     factRow("accepted", facts.accepted.empty() ? "by nobody" : facts.accepted);
  constexpr std::array<std::string_view, 8> kElsewhere{
      "machine",       "probe",           "mounting",           "measured_utc",
      "temperature_c", "sphere_next_due", "sphere_certificate", metrology::kStylusBall};
  auto others = result.conditions;
  std::erase_if(others, [&](const auto& one) { return std::ranges::find(kElsewhere, one.name) != kElsewhere.end(); });
  return text + conditionRows(others) + "</table>\n";
}

std::string partyInWords(const board::Party& party) {
  std::string words = party.name;
  for (const auto& part : {party.address, party.city, party.country, party.email})
    if (!part.empty()) words += ", " + part;
  return words;
}

// Laboratory, customer and item, in the order of ISO/IEC 17025:2017, 7.8.2.1.
std::string partiesTable(const CertificateFacts& facts, const board::Parties& parties) {
  const auto& words = parties.calibration;
  std::string text = "<table>\n" + factRow("laboratory", partyInWords(parties.laboratory)) +
                     factRow("accreditation", orNotStated(parties.laboratory.accreditation)) +
                     factRow("place of the calibration", orNotStated(words.place)) +
                     factRow("customer", partyInWords(parties.customer)) +
                     factRow("item", words.item.empty() ? facts.machine : words.item + " (" + facts.machine + ")") +
                     factRow("its condition", orNotStated(words.item_condition)) +
                     factRow("received", orNotStated(words.received)) +
                     factRow("environment", orNotStated(words.environment)) +
                     factRow("deviations from the method", words.deviations.empty() ? "none" : words.deviations);
  if (!words.statement.empty()) text += factRow("the laboratory states", words.statement);
  return text + "</table>\n";
}

// Clauses of ISO/IEC 17025:2017, 7.8.2.1 d and l, and its note 2.
std::string clauses(const CertificateFacts& facts, const board::Parties* parties, const std::string& version) {
  const bool accredited = parties != nullptr && !parties->laboratory.accreditation.empty();
  std::string text = "The results relate only to the item named here, as it was when it was measured.";
  if (parties != nullptr)
    text +=
        " What stands here of laboratory, customer, item and environment is stated by the laboratory. This "
        "certificate may not be reproduced except in full without the approval of " +
        parties->laboratory.name + ".";
  text += " The day of the next calibration is named where it was agreed with the customer.";
  if (!accredited) text += " It states what was measured, and is no certificate of an accredited laboratory.";
  return "<p class=\"small\">" + escaped(text) + "</p>\n<p class=\"small\">probebox " + escaped(version) +
         "; terms of JCGM 200:2012 and JCGM 100:2008, equations as numbered in docs/metrology.md.</p>\n" +
         element("p", "End of calibration certificate " + facts.number) + "\n";
}

std::string issue(const CertificateFacts& facts) {
  return "<h2>Issue</h2>\n<table>\n" + factRow("certificate", facts.number) + factRow("issued", facts.issued_utc) +
         factRow("issued from a box with firmware", orNotStated(facts.firmware)) +
         factRow("issued by", orNotStated(facts.issued_by)) +
         factRow("next calibration due", orNotStated(facts.next_due)) + factRow("signature", "") + "</table>\n";
}

}  // namespace

std::string conditionOf(const metrology::Result& result, std::string_view name) {
  const auto found = std::ranges::find(result.conditions, name, &metrology::Condition::name);
  return found == result.conditions.end() ? "" : found->value;
}

std::string measuredUtc(const metrology::Result& result, const CertificateFacts& facts) {
  const auto stated = conditionOf(result, "measured_utc");
  return stated.empty() ? facts.stored_utc : stated;
}

std::string_view measurandOf(std::string_view subject) {
  const auto parsed = parseSubject(subject);
  const auto* found = parsed ? std::ranges::find(kMeasurands, parsed->kind, &Measurand::kind) : kMeasurands.end();
  return found == kMeasurands.end() ? std::string_view{} : found->sentence;
}

bool isPlace(const metrology::Estimate& estimate) {
  constexpr std::array<std::string_view, 6> kPlaces{quantity::kMeanHeight.key,
                                                    quantity::kAlong.key,
                                                    quantity::kAxisPoint.key,
                                                    quantity::kAxisDirection.key,
                                                    "arm_mm",
                                                    quantity::kEffectiveDiameter.key};
  return std::ranges::find(kPlaces, estimate.key) != kPlaces.end();
}

std::vector<std::string> reservationsAbout(const Subject& subject, const CertificateFacts& facts) {
  const Result& result = *subject.result();
  std::vector<std::string> all;
  const bool is_traceable = !whyNotTraceable(result, facts);
  if (is_traceable)
    all.emplace_back(
        "Not traceable are the contributions of the scales of the machine and the clock of the box: no certificate of "
        "them is on record.");
  if (is_traceable && conditionOf(result, "temperature_c").empty())
    all.emplace_back(
        "The temperature of the sphere is not stated: the values hold if it was 20 \u00b0C. In steel each kelvin is "
        "11.5 \u00b5m per metre of its diameter. State it for the run (probebox calibrate --temperature) or in "
        "[datum_sphere] of machine.toml.");
  if (ballIsAssumed(result)) all.push_back("Stylus ball: " + conditionOf(result, metrology::kStylusBall) + ".");
  if (facts.accepted.empty())
    all.emplace_back("This result was accepted by nobody: it is a proposal, and not in force.");
  if (!verdictOn(subject))  // whose box says it already
    all.insert(all.end(), subject.rests_on.begin(), subject.rests_on.end());
  return all;
}

std::optional<std::string> whyNotTraceable(const Result& result, const CertificateFacts& facts) {
  if (conditionOf(result, "sphere_certificate").empty())
    return "This result is not metrologically traceable: no certificate of a reference sphere is on record for it. Its "
           "uncertainty is that of the readings and of the inputs in the budget alone.";
  const auto due = conditionOf(result, "sphere_next_due"), certified = certifiedDay(result);
  const auto measured = measuredUtc(result, facts);
  if (const auto day = measured.substr(0, certified.size()); day < certified)
    return "This result is not metrologically traceable: it was measured on " + day +
           ", and the reference sphere was calibrated on " + certified + ". Was the clock of the box set?";
  if (!dayOf(measured.substr(0, std::string_view{"2026-11-29"}.size())))
    return "This result is not metrologically traceable: the box had no trusted clock, so when it was measured is not "
           "known (" +
           measured + "), nor whether the certificate of the reference sphere held then.";
  const auto day = measured.substr(0, due.size());
  if (due.empty() || day < due) return std::nullopt;
  return "This result is not metrologically traceable: it was measured on " + day +
         ", and the certificate of the reference sphere was due on " + due + ".";
}

std::string certificatePage(const Subject& subject, const CertificateFacts& facts, const std::string& version,
                            const board::Parties* parties) {
  const Result& result = *subject.result();
  const auto* method = metrology::methodNamed(subject.method);
  const std::string title{method == nullptr ? std::string_view{subject.method} : method->title};
  return documentHead("Calibration certificate " + facts.number, kPageNumbers) + "<article>\n" +
         element("h1", "Calibration certificate " + facts.number) + "\n<p class=\"small\">" + escaped(title) + ", " +
         escaped(subject.name) + "</p>\n" + (parties == nullptr ? "" : partiesTable(facts, *parties)) +
         verdictBox(subject) + traceabilityBox(subject, facts) + conformityTable(subject) +
         resultTable(subject, facts) + changeTable(subject, {"As found and as left", "as found: ", "as left: this"}) +
         warningsList(result) + traceabilityTable(result) + circumstances(subject, facts) + budgetTable(result) +
         factsTable(result) + unobservableList(subject) + issue(facts) + "</article>\n" +
         clauses(facts, parties, version) + "</body>\n</html>\n";
}

}  // namespace probebox::report
