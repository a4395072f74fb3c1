#pragma once
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "board/describe/service.hpp"
#include "firmware/app/host/key_folder.hpp"
#include "firmware/app/results/reply.hpp"
#include "firmware/app/results/unit_record.hpp"

namespace probebox::app {

// Answers requests about the identity of the box. On the worker's thread but for problem().
class UnitRequestHandler {
 public:
  // notes: sentences about the unit in use, for hosts. keys: where those of tls: links go; nullopt: none are taken.
  UnitRequestHandler(UnitRecord record, std::string board_name, std::vector<std::string> notes,
                     std::optional<KeyFolder> keys = {});

  static bool answers(messages::Operation operation);
  Reply answer(messages::Operation operation, std::span<const std::byte> body, const board::Access& may);

  const std::string& problem() const { return record_.problem(); }

 private:
  Reply provision(std::span<const std::byte> body, const board::Access& may);
  Reply provisionKeys(std::span<const std::byte> body, const board::Access& may);
  Reply describe() const;

  UnitRecord record_;
  std::string board_name_;
  std::vector<std::string> notes_;
  std::optional<KeyFolder> keys_;
};

}  // namespace probebox::app
