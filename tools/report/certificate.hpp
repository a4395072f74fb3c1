#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "board/describe/parties.hpp"
#include "tools/report/subject.hpp"

namespace probebox::report {

inline constexpr double kCoverageFactor = 2;

// Facts that a certificate states besides its result.
struct CertificateFacts {
  std::string number;    // of the certificate
  std::string subject;   // what the result is about
  std::string box;       // which box measured: vendor, model, serial number
  std::string firmware;  // of the box at the time of issue; a result does not keep that of its measurement
  std::string probe, machine, mounting;
  std::string stored_utc;  // when the result was stored, ISO 8601
  std::string accepted;    // by whom and when; empty: by nobody
  std::string issued_utc, issued_by;
  std::string next_due;  // of this calibration; empty: not stated
};

// Why the result is not metrologically traceable, a sentence for a person; nothing where it is, to the sphere's
// certificate that its conditions name.
std::optional<std::string> whyNotTraceable(const metrology::Result& result, const CertificateFacts& facts);

// What a reader has to know before he relies on the values, a sentence each: no acceptance, what they rest on, and so
// on.
std::vector<std::string> reservationsAbout(const Subject& subject, const CertificateFacts& facts);
// Describes in one phrase the quantity that values about a subject measure, for a page that is read without the manual;
// empty for a subject that has the name of its method.
std::string_view measurandOf(std::string_view subject);
// Whether it says where the values hold: without it a centre on an inclined axis is no measurand.
bool isPlace(const metrology::Estimate& estimate);
// A condition of the measurement; empty where it is not on record.
std::string conditionOf(const metrology::Result& result, std::string_view name);
// When it was measured, else when the box stored it.
std::string measuredUtc(const metrology::Result& result, const CertificateFacts& facts);

// The result that was in force before, in subject.before, is the one as found.
// parties: the laboratory's template; null: nobody has stated any of it.
// Writes a calibration certificate of a result, with the terms of JCGM 200:2012 (VIM) and JCGM 100:2008 (GUM): one HTML
// document that prints on A4. version: of the program that writes it.
std::string certificatePage(const Subject& subject, const CertificateFacts& facts, const std::string& version,
                            const board::Parties* parties = nullptr);

}  // namespace probebox::report
