#include <algorithm>
#include <cerrno>
#include <gtest/gtest.h>

#include "host-tests/faults/disk_image.hpp"
#include "host-tests/faults/supervised.hpp"
#include "host-tests/support/runs.hpp"
#include "sent_bundle.hpp"

// A bundle on a disk that fails: every call on its files, one after the other.
namespace probebox::app {
namespace {

using faults::Call;
using faults::Decision;

constexpr std::size_t kSize = 1'100'000;  // a part is stored on the way, and one at the end

// Sends a bundle and says what each refusal was, or "handed over".
void transfer(const std::filesystem::path& folder, const faults::Say& say) {
  const auto bytes = bundleBytes(kSize);
  SentBundle box{folder};
  const auto said = [&](const Reply& reply) {
    if (reply.code != messages::ErrorCode::ok) say(reply.text);
    return reply.code == messages::ErrorCode::ok;
  };
  const auto offered = box.offerReply(bytes);
  if (!said(offered)) return;
  const auto answer = messages::decode<messages::OfferUpdate::Answer>(offered.body).value();
  box.offered = answer.offer;
  for (std::size_t at = answer.received_bytes; at < bytes.size(); at += messages::kMostUpdateBytes) {
    if (!said(box.send(bytes, at, messages::kMostUpdateBytes))) return;
  }
  box.install();
  box.look();
  const auto status = box.status();
  say(status.state == messages::UpdateState::waiting ? "handed over" : status.text);
}

bool grows(const Call& call) {
  return call.kind == Call::Kind::write || (call.kind == Call::Kind::open && call.creates);
}

class FaultyDisk : public testing::Test {
 protected:
  void SetUp() override {
    if (const auto why = faults::whyNoSupervision(); !why.empty()) GTEST_SKIP() << why;
  }
  // One transfer with this decision at the call number `at`, and from there on where for_good. What was said.
  faults::Ended transferWith(std::size_t at, Decision decision, bool for_good, const std::filesystem::path& folder) {
    std::size_t calls = 0;
    reached_ = false;
    return faults::supervise(
        folder, [&](const faults::Say& say) { transfer(folder, say); },
        [&](const Call& call) {
          ++calls;
          if (calls < at || (calls > at && !for_good)) return Decision{};
          reached_ = true;
          return decision.error == ENOSPC && !grows(call) ? Decision{} : decision;
        });
  }
  // Afterwards, on a disk that is well.
  static void expectToBeGoodAgain(const std::filesystem::path& folder) {
    const auto bytes = bundleBytes(kSize);
    SentBundle box{folder};
    if (box.status().state == messages::UpdateState::waiting) {  // it was handed over
      EXPECT_EQ(textIn(box.requests() / "bundle"), bytes);
      return;
    }
    box.sendAll(bytes, box.offer(bytes));
    box.install();
    box.look();
    EXPECT_EQ(box.status().state, messages::UpdateState::waiting) << box.status().text;
    EXPECT_EQ(textIn(box.requests() / "bundle"), bytes);
  }
  // The interesting calls: those at the beginning and at the end, each third where runs are not complete, and one in 30
  // of the many writes between.
  template <class Each>
  void atEveryCall(const Each& each) {
    const std::size_t step = runsAreComplete() ? 1 : 3;
    for (std::size_t at = 1;; at += at > 30 && at < 270 ? 30 : step) {
      const support::TemporaryFolder folder{support::inMemory()};
      SCOPED_TRACE("call " + std::to_string(at));
      each(at, folder.path());
      if (!reached_ || HasFailure()) return;
      ASSERT_LT(at, 5'000U);
    }
  }

  bool reached_{};
};

TEST_F(FaultyDisk, AFullOneIsNamedAndLeavesNothingBehind) {
  std::size_t named = 0;
  atEveryCall([&](std::size_t at, const std::filesystem::path& folder) {
    const auto ended = transferWith(at, {Decision::What::fail, ENOSPC}, true, folder);
    ASSERT_FALSE(ended.hung);
    ASSERT_FALSE(ended.said.empty());
    if (ended.said.back() != "handed over") {
      named += ended.said.back().starts_with("disk-full") ? 1U : 0U;
      EXPECT_TRUE(ended.said.back().starts_with("disk-full") || ended.said.back().starts_with("disk-failed"))
          << ended.said.back();
    }
    expectToBeGoodAgain(folder);
  });
  EXPECT_GT(named, runsAreComplete() ? 10U : 3U) << "while the bundle itself was written";
}

TEST_F(FaultyDisk, OneFailureIsNamedOrMadeGood) {
  atEveryCall([&](std::size_t at, const std::filesystem::path& folder) {
    const auto ended = transferWith(at, {Decision::What::fail, EIO}, false, folder);
    ASSERT_FALSE(ended.hung);
    ASSERT_FALSE(ended.said.empty());
    expectToBeGoodAgain(folder);
  });
}

TEST_F(FaultyDisk, AKillAtAnyCallLosesNoMoreThanWhatWasNotStored) {
  atEveryCall([&](std::size_t at, const std::filesystem::path& folder) {
    const auto ended = transferWith(at, {Decision::What::kill, 0}, false, folder);
    ASSERT_TRUE(ended.killed || !reached_);
    expectToBeGoodAgain(folder);
  });
}

// What was not synced is lost, or there by chance.
TEST_F(FaultyDisk, APowerCutAtAnyCallIsMadeGood) {
  for (const auto fate : {faults::DiskImage::Unsynced::lost, faults::DiskImage::Unsynced::torn}) {
    atEveryCall([&](std::size_t at, const std::filesystem::path& folder) {
      const auto files = folder / "update";
      std::filesystem::create_directories(files);
      faults::DiskImage image{files};
      std::size_t calls = 0;
      const auto ended = faults::supervise(
          files, [&](const faults::Say& say) { transfer(folder, say); },
          [&](const Call& call) {
            if (++calls == at) return Decision{Decision::What::kill, 0};
            image.note(call);
            return Decision{};
          });
      reached_ = ended.killed;
      image.cutPower(fate, at);
      expectToBeGoodAgain(folder);
    });
  }
}

}  // namespace
}  // namespace probebox::app
