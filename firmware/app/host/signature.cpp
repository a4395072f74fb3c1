#include "firmware/app/host/signature.hpp"

#include "protocol/messages/control.hpp"
#include "protocol/messages/fields.hpp"
#include "protocol/units/wording.hpp"

namespace probebox::app {
namespace {

using messages::Operation;
using Body = std::vector<std::byte>;

template <class Of>
Outcome<Body> withName(const std::string& person, std::span<const std::byte> body) {
  auto request = messages::decode<typename Of::Request>(body);
  if (!request) return Body{body.begin(), body.end()};
  if (!request->by.empty() && request->by != person)
    return Error{"The certificate of this link is that of " + person + ", and the request is signed by " +
                 shown(request->by, kLongestName) + ": leave --by out, or use the certificate of that person."};
  request->by = person;
  return messages::encoded(*request);
}

}  // namespace

Outcome<Body> signedBy(const std::string& person, Operation operation, std::span<const std::byte> body) {
  switch (operation) {
    case Operation::accept_result:
      return withName<messages::AcceptResult>(person, body);
    case Operation::rollback_result:
      return withName<messages::RollbackResult>(person, body);
    case Operation::set_inhibit:
      return withName<messages::SetInhibit>(person, body);
    case Operation::home_axes:
      return withName<messages::HomeAxes>(person, body);
    case Operation::propose_case:
      return withName<messages::ProposeCase>(person, body);
    default:
      return Body{body.begin(), body.end()};
  }
}

}  // namespace probebox::app
