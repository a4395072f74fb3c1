#pragma once
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "protocol/messages/types.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::app {

// Returns the body of a request as the person has signed it who has proved to be there: where an operation has `by`,
// the name is that person's, also where the host left it out. Requests of other operations, and malformed ones, are
// returned as they are. Error: the request is signed in the name of somebody else.
Outcome<std::vector<std::byte>> signedBy(const std::string& person, messages::Operation operation,
                                         std::span<const std::byte> body);

}  // namespace probebox::app
