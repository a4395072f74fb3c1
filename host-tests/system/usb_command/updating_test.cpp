#include <atomic>
#include <fstream>
#include <iterator>
#include <mutex>
#include <thread>

#include "box_on_usb.hpp"
#include "firmware/app/update/update_request_handler.hpp"
#include "host-tests/support/bundle_file.hpp"

namespace probebox::command {
namespace {

using namespace std::chrono_literals;

// A box on USB whose updates the firmware's own handler answers.
class Updating : public BoxOnUsb {
 protected:
  void SetUp() override {
    BoxOnUsb::SetUp();
    if (!bus_) return;
    box_ = std::make_unique<FakeBox>(
        FakeBoxOptions{.answers_first = [this](auto operation, auto body) { return answer(operation, body); }},
        [this] { return gadget_->accept(); });
  }

  std::optional<FakeReply> answer(messages::Operation operation, std::span<const std::byte> body) {
    if (!app::UpdateRequestHandler::answers(operation)) return std::nullopt;
    // The cable is pulled in the middle, however late the person is.
    while (received() >= kPulledAtBytes && !pulled_) std::this_thread::sleep_for(1ms);
    const std::lock_guard lock{mutex_};
    do {
      look_again_ = false;
      handler_.look();
    } while (look_again_);
    auto reply = handler_.answer(operation, body, {.link = 1, .connection = "usb", .may = {.allow_update = true}});
    return FakeReply{reply.code, std::move(reply.text), std::move(reply.body)};
  }
  std::uint64_t received() {
    const std::lock_guard lock{mutex_};
    const auto reply = handler_.answer(messages::Operation::update_status, {}, {});
    return messages::decode<messages::UpdateStatus::Answer>(reply.body)->received_bytes;
  }

  static constexpr std::uint64_t kPulledAtBytes = 2'000'000;
  std::atomic<bool> pulled_{};
  std::mutex mutex_;
  bool look_again_{};
  app::UpdateRequestHandler handler_{
      directory_.file("update"),
      directory_.file("reports"),
      {[] { return app::Activity{}; }, [this] { look_again_ = true; }, [] { return true; }}};
  const std::string file_{directory_.file("box.raucb")};
};

TEST_F(Updating, ABundleGoesOnAfterTheCableWasPulled) {
  const auto bundle = support::writeBundle(file_, 6'000'000, "2.0");
  const std::jthread person{[this](const std::stop_token& stop) {
    while (!stop.stop_requested() && received() < kPulledAtBytes) std::this_thread::sleep_for(1ms);
    unplug();
    pulled_ = true;
    std::this_thread::sleep_for(100ms);
    plugIn();
  }};
  const auto update = probebox({"-u", "usb", "--json", "update", file_, "--no-wait"});
  EXPECT_EQ(update.status, 0) << update.err;
  EXPECT_THAT(update.err, testing::AllOf(testing::HasSubstr("waiting"), testing::HasSubstr("usb:PB-0001")));
  EXPECT_GE(update.object()["sent_bytes"], bundle.size());
  EXPECT_LT(update.object()["sent_bytes"], bundle.size() + 100'000) << "what had arrived is not sent again";
  EXPECT_EQ(update.object()["state"], "waiting");
  std::ifstream in{directory_.file("update/bundle"), std::ios::binary};
  EXPECT_TRUE((std::string{std::istreambuf_iterator<char>{in}, {}} == bundle));
}

}  // namespace
}  // namespace probebox::command
