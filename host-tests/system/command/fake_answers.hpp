#pragma once
#include <atomic>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "fake_box.hpp"
#include "firmware/metrology/dataset/dataset.hpp"
#include "protocol/messages/control.hpp"
#include "protocol/messages/handshake.hpp"

namespace probebox::command {

messages::Descriptor fakeDescriptor();

// What a run of the fake box measured.
metrology::Dataset fakeDataset();

// The scripted other side of the control channel. Every question about the procedure moves it on by one step.
class FakeAnswers {
 public:
  using Reply = FakeReply;

  explicit FakeAnswers(const FakeBoxOptions& options) : options_{options}, running_{options.busy} {}

  Reply answer(messages::Operation operation, std::span<const std::byte> body);
  // Any thread.
  bool calibrating() const { return running_; }

 private:
  Reply status() const;
  Reply loopBack() const;
  Reply start();
  Reply abort(std::span<const std::byte> body);
  Reply procedure();
  Reply mark(std::span<const std::byte> body);
  Reply results(std::span<const std::byte> body) const;
  messages::AcceptResult::Answer compared() const;
  Reply accept(std::span<const std::byte> body);
  Reply rollBack(std::span<const std::byte> body) const;
  Reply history(std::span<const std::byte> body) const;
  Reply dataset(std::span<const std::byte> body) const;
  Reply kept(std::span<const std::byte> body) const;
  messages::ResultSummary proposedOne() const;
  messages::ResultSummary oneInForce() const;
  messages::ResultSummary refusedOne() const;

  static constexpr unsigned kSteps = 3;
  // 7 is what a start answers, and 6 what somebody else has going on.
  std::uint32_t presentRun() const { return options_.at_another_run ? 8 : options_.busy ? 6 : 7; }

  FakeBoxOptions options_;
  std::atomic<bool> running_{};
  unsigned asked_{};
  bool proposed_{true};
  std::string accepted_by_;
};

}  // namespace probebox::command
