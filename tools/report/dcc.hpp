#pragma once
#include <string>

#include "board/describe/parties.hpp"
#include "protocol/units/outcome.hpp"
#include "tools/report/certificate.hpp"

namespace probebox::report {

// Writes the same certificate as a Digital Calibration Certificate of PTB: XML by schema 3.1.2 (https://ptb.de/dcc),
// values with units of D-SI 2.1.0. version: of the program that writes it. Error: what the schema requires is not
// known.
Outcome<std::string> dccDocument(const Subject& subject, const CertificateFacts& facts, const board::Parties& parties,
                                 const std::string& version);

}  // namespace probebox::report
