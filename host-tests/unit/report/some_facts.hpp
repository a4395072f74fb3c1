#pragma once
#include "tools/report/certificate.hpp"

// What tests of certificates know of a result and its box.
namespace probebox::report {

inline CertificateFacts someFacts() {
  return {.number = "PB-1-17",
          .subject = "delay",
          .box = "Acme & Co, PB-1",
          .firmware = "9.8.7",
          .probe = "P-9",
          .machine = "mill 3",
          .mounting = "spindle",
          .stored_utc = "2026-11-26T08:01:00Z",
          .accepted = "by Ada, 2026-11-26T09:00:00Z",
          .issued_utc = "2026-11-27T10:00:00Z",
          .issued_by = "Grace",
          .next_due = "2027-11-26"};
}

}  // namespace probebox::report
