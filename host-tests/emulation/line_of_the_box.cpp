#include "host-tests/emulation/line_of_the_box.hpp"

namespace probebox::scenario {

std::vector<std::uint16_t> LineOfTheBox::read(std::uint16_t first, std::size_t count) {
  const auto& snapshot = office_.scenario().state().snapshot;
  published::LineState line;
  line.boots = 1;
  line.features.sphere_reach_mm = office_.scenario().facts.sphereReach_mm().value_or(0);
  line.controller_request = requests_.state(snapshot);
  image_.fill(snapshot, line, boot_.inForce().served(), modbus::WordOrder::high_first);
  writable_.show(image_.registers());
  const auto words = std::as_const(image_).registers().subspan(first, count);
  return {words.begin(), words.end()};
}

bool LineOfTheBox::write(std::uint16_t first, std::span<const std::uint16_t> values) {
  auto changed = writable_;
  const auto events = changed.write(first, values);
  if (!events) return false;
  if (boot_.take(*events)) return false;
  const bool requests = changed.controllerRequest().commit != writable_.controllerRequest().commit;
  writable_ = changed;
  if (requests) requests_.make(writable_.controllerRequest());
  return true;
}

void LineOfTheBox::ask(messages::Operation operation, const std::vector<std::byte>& body,
                       const std::function<void(app::Reply)>& then) {
  if (operation != messages::Operation::accept_result) return then(boot_.ask(operation, body));
  // The worker's part of the handler.
  const auto request = messages::decode<messages::AcceptResult::Request>(body).value();
  const auto accepted = boot_.inForce().accept(request.id, request.by, request.although_it_differs);
  if (accepted) return then(app::ok(messages::AcceptResult::Answer{}));
  then(app::refused(messages::ErrorCode::wrong_state, accepted.error().what));
}

}  // namespace probebox::scenario
