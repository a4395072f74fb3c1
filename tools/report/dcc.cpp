#include "tools/report/dcc.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <string_view>
#include <vector>

#include "firmware/metrology/methods.hpp"
#include "protocol/units/calendar.hpp"
#include "tools/report/conformity.hpp"
#include "tools/report/coverage.hpp"
#include "tools/report/html.hpp"
#include "tools/report/names.hpp"

namespace probebox::report {
namespace {

using metrology::Estimate;
using metrology::Result;

// The units in which pages show values, as D-SI writes them.
struct DsiUnit {
  std::string_view shown, dsi;
};
constexpr auto kDsiUnits = std::to_array<DsiUnit>({
    {"", "\\one"},
    {"us", "\\micro\\second"},
    {"um", "\\micro\\metre"},
    {"mm", "\\milli\\metre"},
    {"urad", "\\micro\\radian"},
    {"deg", "\\degree"},
    {"Hz", "\\hertz"},
    {"mm/s", "\\milli\\metre\\per\\second"},
    {"um/s", "\\micro\\metre\\per\\second"},
    {"um/min", "\\micro\\metre\\per\\minute"},
    {"1/mm", "\\per\\milli\\metre"},
});

// An element around others.
std::string node(std::string_view name, const std::string& content) {
  return "<" + std::string{name} + ">" + content + "</" + std::string{name} + ">\n";
}
std::string leaf(std::string_view name, std::string_view text) {
  return element(name, text) + "\n";
}
std::string words(std::string_view name, std::string_view text) {
  return node(name, "<dcc:content lang=\"en\">" + escaped(text) + "</dcc:content>");
}

std::string contact(const board::Party& party) {
  return words("dcc:name", party.name) + leaf("dcc:eMail", party.email) +
         node("dcc:location", leaf("dcc:city", party.city) + leaf("dcc:countryCode", party.country));
}

std::string identified(std::string_view issuer, std::string_view value, std::string_view what) {
  return node("dcc:identification", leaf("dcc:issuer", issuer) + leaf("dcc:value", value) + words("dcc:name", what));
}

std::string administrativeData(const CertificateFacts& facts, const board::Parties& parties, const std::string& day,
                               const std::string& version) {
  const auto software = words("dcc:name", "probebox") + leaf("dcc:release", version) + leaf("dcc:type", "application");
  const auto core = leaf("dcc:countryCodeISO3166_1", parties.laboratory.country) +
                    leaf("dcc:usedLangCodeISO639_1", "en") + leaf("dcc:mandatoryLangCodeISO639_1", "en") +
                    leaf("dcc:uniqueIdentifier", facts.number) + leaf("dcc:beginPerformanceDate", day) +
                    leaf("dcc:endPerformanceDate", day) + leaf("dcc:performanceLocation", "customer");
  const auto item = words("dcc:name", facts.machine) + words("dcc:description", "about: " + facts.subject) +
                    node("dcc:manufacturer", words("dcc:name", "not stated")) +
                    node("dcc:identifications", identified("owner", facts.machine, "name of the machine"));
  return node(
      "dcc:administrativeData",
      node("dcc:dccSoftware", node("dcc:software", software)) + node("dcc:coreData", core) +
          node("dcc:items", node("dcc:item", item)) +
          node("dcc:calibrationLaboratory", node("dcc:contact", contact(parties.laboratory))) +
          node("dcc:respPersons", node("dcc:respPerson", node("dcc:person", words("dcc:name", facts.issued_by)) +
                                                             leaf("dcc:mainSigner", "true"))) +
          node("dcc:customer", contact(parties.customer)));
}

std::string equipment(std::string_view name, std::string_view what) {
  return node("dcc:measuringEquipment", words("dcc:name", name) + words("dcc:description", what));
}

std::string probability(double value) {
  std::array<char, 16> text{};
  std::snprintf(text.data(), text.size(), "%.3f", std::clamp(value, 0.0, 1.0));
  return text.data();
}

std::string quantityOf(const Subject& subject, const Estimate& estimate, std::size_t k) {
  const auto unit = unitOf(estimate, k);
  const auto u = combinedOf(estimate, k);
  const auto value = valueDigits(unit, estimate.values[k], u);
  const auto* dsi = std::ranges::find(kDsiUnits, unit.unit, &DsiUnit::shown);
  const auto name = words("dcc:name", valueName(subject, estimate, k));
  if (dsi == kDsiUnits.end()) return node("dcc:quantity", name + words("dcc:noQuantity", value + " " + unit.unit));
  std::string real = leaf("si:value", value) + leaf("si:unit", dsi->dsi);
  if (u && *u > 0) {
    const auto coverage = coverageOf(*subject.result(), estimate, k, kCoverageFactor);
    real +=
        node("si:expandedUnc", leaf("si:uncertainty", uncertaintyDigits(unit, *u)) + leaf("si:coverageFactor", "2") +
                                   leaf("si:coverageProbability", probability(coverage)));
  }
  return node("dcc:quantity", name + node("si:real", real));
}

std::string conditionsOf(const Result& result) {
  const auto temperature = conditionOf(result, "temperature_c");
  if (temperature.empty()) return "";
  const auto real = leaf("si:value", temperature) + leaf("si:unit", "\\degreecelsius");
  return node("dcc:influenceConditions",
              node("dcc:influenceCondition",
                   words("dcc:name", "temperature") + node("dcc:data", node("dcc:quantity", node("si:real", real)))));
}

// The answers of the decision rule, for values that have limits.
std::vector<std::string> conformityOf(const Subject& subject) {
  std::vector<std::string> all;
  if (!verdictOn(subject)) return all;
  for (const auto& judged : judgedValues(subject)) {
    if (!judged.limit || !judged.proof) continue;
    all.push_back(judgedName(subject, judged) + ": limit " + limitDigits(*judged.deviation, *judged.limit) + " " +
                  unitOf(*judged.deviation, 0).unit + ", " + wordOf(judged));
  }
  all.push_back(decisionRule());
  return all;
}

std::string statements(const Subject& subject, const CertificateFacts& facts) {
  const Result& result = *subject.result();
  const auto why = whyNotTraceable(result, facts);
  const auto said = why ? *why : "reference sphere: " + conditionOf(result, "sphere_certificate");
  auto all = node("dcc:metaData", leaf("dcc:traceable", why ? "false" : "true") + words("dcc:declaration", said));
  for (const auto& sentences : {reservationsAbout(subject, facts), result.warnings, conformityOf(subject)})
    for (const auto& sentence : sentences) all += node("dcc:metaData", words("dcc:declaration", sentence));
  if (!facts.next_due.empty())
    all += node("dcc:metaData", words("dcc:declaration", "next calibration due") + leaf("dcc:date", facts.next_due));
  return node("dcc:measurementMetaData", all);
}

std::string measurement(const Subject& subject, const CertificateFacts& facts) {
  const Result& result = *subject.result();
  const auto* method = metrology::methodNamed(subject.method);
  const std::string title{method == nullptr ? std::string_view{subject.method} : method->title};
  std::string quantities;
  for (const auto& estimate : result.estimates)
    for (std::size_t k = 0; k < estimate.values.size(); ++k)
      if (!casefolder::zeroByDefinition(estimate, k)) quantities += quantityOf(subject, estimate, k);
  std::string places;
  for (const auto& estimate : result.also)
    for (std::size_t k = 0; isPlace(estimate) && k < estimate.values.size(); ++k)
      places += quantityOf(subject, estimate, k);
  if (!places.empty())
    places = node("dcc:result", words("dcc:name", "where the values hold") + node("dcc:data", places));
  const auto measurand = measurandOf(facts.subject);
  const auto about = measurand.empty() ? std::string{} : words("dcc:description", measurand);
  const auto sphere = conditionOf(result, "sphere_certificate");
  const auto with = equipment(facts.box, "probebox, firmware " + facts.firmware) +
                    equipment(facts.probe, "probe, " + facts.mounting) +
                    (sphere.empty() ? "" : equipment("reference sphere", sphere));
  return node(
      "dcc:measurementResult",
      words("dcc:name", title) +
          node("dcc:usedMethods",
               node("dcc:usedMethod", words("dcc:name", title) + words("dcc:description", subject.method) +
                                          leaf("dcc:norm", "JCGM 100:2008"))) +
          node("dcc:measuringEquipments", with) + conditionsOf(result) +
          node("dcc:results",
               node("dcc:result", words("dcc:name", subject.name) + about + node("dcc:data", quantities)) + places) +
          statements(subject, facts));
}

}  // namespace

Outcome<std::string> dccDocument(const Subject& subject, const CertificateFacts& facts, const board::Parties& parties,
                                 const std::string& version) {
  const auto day = measuredUtc(*subject.result(), facts).substr(0, std::string_view{"2026-11-29"}.size());
  if (!dayOf(day))
    return Error{
        "the box had no trusted clock, so the day of the measurement, which a DCC has to state, is not known: "
        "measure again on a box that knows the date"};
  if (facts.issued_by.empty()) return Error{"a DCC names the person who issues it: add --by NAME"};
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
         "<dcc:digitalCalibrationCertificate xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" "
         "xmlns:dcc=\"https://ptb.de/dcc\" xmlns:si=\"https://ptb.de/si\" "
         "xsi:schemaLocation=\"https://ptb.de/dcc https://ptb.de/dcc/v3.1.2/dcc.xsd\" schemaVersion=\"3.1.2\">\n" +
         administrativeData(facts, parties, day, version) +
         node("dcc:measurementResults", measurement(subject, facts)) + "</dcc:digitalCalibrationCertificate>\n";
}

}  // namespace probebox::report
