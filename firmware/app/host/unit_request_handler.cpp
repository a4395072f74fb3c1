#include "firmware/app/host/unit_request_handler.hpp"

#include <utility>

#include "firmware/app/log/log.hpp"
#include "firmware/app/update/keyring.hpp"
#include "protocol/messages/unit.hpp"

namespace probebox::app {
namespace {

using messages::ErrorCode;
using messages::Operation;

messages::SphereCertificate wireSphere(const board::CalibratedSphere& sphere) {
  return {.serial_number = sphere.serial_number,
          .diameter_mm = sphere.diameter_mm,
          .expanded_uncertainty_um = sphere.expanded_uncertainty_um,
          .coverage_factor = sphere.coverage_factor,
          .certificate = sphere.certificate,
          .laboratory = sphere.laboratory,
          .date = sphere.date,
          .next_due = sphere.next_due};
}

}  // namespace

UnitRequestHandler::UnitRequestHandler(UnitRecord record, std::string board_name, std::vector<std::string> notes,
                                       std::optional<KeyFolder> keys)
    : record_{std::move(record)},
      board_name_{std::move(board_name)},
      notes_{std::move(notes)},
      keys_{std::move(keys)} {}

bool UnitRequestHandler::answers(Operation operation) {
  return operation == Operation::provision || operation == Operation::provision_keys ||
         operation == Operation::describe_unit;
}

Reply UnitRequestHandler::answer(Operation operation, std::span<const std::byte> body, const board::Access& may) {
  if (operation == Operation::provision_keys) return provisionKeys(body, may);
  return operation == Operation::provision ? provision(body, may) : describe();
}

Reply UnitRequestHandler::provision(std::span<const std::byte> body, const board::Access& may) {
  const auto request = messages::decode<messages::Provision::Request>(body);
  if (!request) return malformed(Operation::provision);
  if (!may.allow_provision.value_or(false)) return notPermitted("allow_provision");
  const auto unit = record_.write(request->text, board_name_);
  if (!unit) return refused(ErrorCode::refused, unit.error().what);
  logInfo("the box was provisioned as " + unit->serial_number);
  return ok(messages::Provision::Answer{.serial_number = unit->serial_number});
}

Reply UnitRequestHandler::provisionKeys(std::span<const std::byte> body, const board::Access& may) {
  const auto request = messages::decode<messages::ProvisionKeys::Request>(body);
  if (!request) return malformed(Operation::provision_keys);
  if (!may.allow_provision.value_or(false)) return notPermitted("allow_provision");
  if (!keys_) return refused(ErrorCode::refused, "This box keeps no keys.");
  if (keys_->haveOtherPeople(*request) && !may.allow_other_people) return notPermitted("allow_other_people");
  if (const auto why = keys_->write(*request)) return refused(ErrorCode::refused, why->what);
  logInfo("the box was provisioned with keys for tls: links");
  return ok(messages::Nothing{});
}

Reply UnitRequestHandler::describe() const {
  messages::DescribeUnit::Answer answer{.provisioned = record_.locked(), .notes = notes_, .image_keys = imageKeys()};
  if (!record_.problem().empty()) answer.notes.push_back(record_.problem());
  if (const auto& unit = record_.unit()) {
    answer.in_use = record_.inUse().has_value();
    answer.serial_number = unit->serial_number;
    answer.vendor = unit->vendor;
    answer.model = unit->model;
    answer.board = unit->board;
    answer.usb_vendor_id = unit->usb_vendor_id;
    answer.usb_product_id = unit->usb_product_id;
    if (unit->sphere) answer.sphere.push_back(wireSphere(*unit->sphere));
    answer.update_keys = unit->update_keys;
  }
  return ok(answer);
}

}  // namespace probebox::app
