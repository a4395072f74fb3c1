#include "firmware/app/host/signature.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "protocol/messages/control.hpp"
#include "protocol/messages/fields.hpp"

namespace probebox::app {
namespace {

// What the box is to record; empty where it is refused.
template <class Operation>
std::string nameIn(const std::string& person, typename Operation::Request request) {
  const auto body = signedBy(person, Operation::kOperation, messages::encoded(request));
  return body ? messages::decode<typename Operation::Request>(*body)->by : std::string{};
}

template <class Operation>
void isSignedByThePerson() {
  typename Operation::Request request;
  EXPECT_EQ(nameIn<Operation>("Ada", request), "Ada");
  request.by = "Ada";
  EXPECT_EQ(nameIn<Operation>("Ada", request), "Ada");
  for (const auto* other : {"Bob", "ada", "Ada ", " "}) {
    request.by = other;
    EXPECT_EQ(nameIn<Operation>("Ada", request), "") << other;
  }
}

TEST(Signature, IsThatOfTheCertificateWhereverSomebodySigns) {
  isSignedByThePerson<messages::AcceptResult>();
  isSignedByThePerson<messages::RollbackResult>();
  isSignedByThePerson<messages::SetInhibit>();
  isSignedByThePerson<messages::HomeAxes>();
  isSignedByThePerson<messages::ProposeCase>();
}

TEST(Signature, ChangesNothingElse) {
  messages::AcceptResult::Request request{.id = 17, .although_it_differs = true};
  const auto body = signedBy("Ada", messages::Operation::accept_result, messages::encoded(request));
  ASSERT_TRUE(body);
  request.by = "Ada";
  EXPECT_EQ(*body, messages::encoded(request));
  const auto start = messages::encoded(messages::StartProcedure::Request{.method = "centreline"});
  EXPECT_EQ(*signedBy("Ada", messages::Operation::start_procedure, start), start);
  const std::vector<std::byte> cut_off{std::byte{1}};
  EXPECT_EQ(*signedBy("Ada", messages::Operation::accept_result, cut_off), cut_off);
}

}  // namespace
}  // namespace probebox::app
