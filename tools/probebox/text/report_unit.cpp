#include "tools/probebox/text/report_unit.hpp"

#include <chrono>

#include "protocol/units/calendar.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

using messages::SphereCertificate;
using Unit = messages::DescribeUnit::Answer;

std::string unitRow(const char* name, const std::string& value) {
  return printed("%-18s %s\n", name, value.c_str());
}

bool isOverdue(const SphereCertificate& sphere, const std::string& today) {
  return today != kNoDate && sphere.next_due <= today;
}

std::string sphereText(const SphereCertificate& s) {
  return s.serial_number +
         printed(", %.9g mm, U = %.6g um (k = %g)", s.diameter_mm, s.expanded_uncertainty_um, s.coverage_factor);
}

std::string certificateText(const SphereCertificate& s, const std::string& today) {
  return s.certificate + " of " + s.laboratory + ", " + s.date + ", next due " + s.next_due +
         (isOverdue(s, today) ? " (OVERDUE)" : "");
}

}  // namespace

std::string nowUtc() {
  const auto now = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now());
  return couldBeNow(now) ? isoUtc(now) : kNoDate;
}

std::string today() {
  const auto now = nowUtc();
  return now == kNoDate ? now : now.substr(0, 10);
}

std::optional<std::string> overdue(const Unit& unit, const std::string& today) {
  if (unit.sphere.empty()) return std::nullopt;
  const auto& sphere = unit.sphere.front();
  if (today == kNoDate)
    return "this computer's clock shows no date that can be: whether the certificate " + sphere.certificate +
           ", due on " + sphere.next_due + ", is overdue is not known";
  if (!isOverdue(sphere, today)) return std::nullopt;
  return "the certificate " + sphere.certificate + " of the sphere " + sphere.serial_number + " was due on " +
         sphere.next_due + ": have it calibrated";
}

Json describe(const Unit& unit, const std::string& today) {
  if (!unit.provisioned) return nullptr;
  Json spheres = nullptr;
  if (!unit.sphere.empty()) {
    const auto& s = unit.sphere.front();
    spheres = {{"serial_number", s.serial_number},
               {"diameter_mm", s.diameter_mm},
               {"expanded_uncertainty_um", s.expanded_uncertainty_um},
               {"coverage_factor", s.coverage_factor},
               {"certificate", s.certificate},
               {"laboratory", s.laboratory},
               {"date", s.date},
               {"next_due", s.next_due},
               {"overdue", today == kNoDate ? Json(nullptr) : Json(isOverdue(s, today))}};
  }
  return {{"in_use", unit.in_use},
          {"serial_number", unit.serial_number},
          {"vendor", unit.vendor},
          {"model", unit.model},
          {"board", unit.board},
          {"usb_vendor_id", unit.usb_vendor_id},
          {"usb_product_id", unit.usb_product_id},
          {"sphere", spheres},
          {"update_keys_sha256", unit.update_keys},
          {"notes", unit.notes}};
}

Json describe(const messages::ProcessStatus& process) {
  if (process.resident_bytes == 0) return nullptr;
  return {{"resident_bytes", process.resident_bytes},
          {"is_root", process.is_root},
          {"capabilities", process.capabilities},
          {"no_new_privileges", process.no_new_privileges},
          {"calls_filtered", process.calls_filtered}};
}

std::string page(const Unit& unit, const std::string& today) {
  if (!unit.provisioned) return unitRow("unit", "not provisioned (probebox provision)");
  std::string all = unitRow("unit", unit.vendor + " " + unit.model + ", " + unit.serial_number +
                                        (unit.in_use ? "" : " (from the next start on)"));
  all += unitRow("USB numbers", printed("%04x:%04x", unsigned{unit.usb_vendor_id}, unsigned{unit.usb_product_id}));
  if (unit.sphere.empty()) all += unitRow("sphere", "none with a certificate");
  for (const auto& sphere : unit.sphere)
    all += unitRow("sphere", sphereText(sphere)) + unitRow("its certificate", certificateText(sphere, today));
  for (const auto& key : unit.update_keys) all += unitRow("update key", "SHA-256 " + key);
  for (const auto& note : unit.notes) all += unitRow("note", note);
  return all;
}

}  // namespace probebox::command
