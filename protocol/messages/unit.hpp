#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "protocol/messages/nothing.hpp"
#include "protocol/messages/types.hpp"

// The identity of a box, as its vendor wrote it.
namespace probebox::messages {

// Writes unit.toml into a box that has none. It is stored when it is answered, and in use from the next start on.
struct Provision {
  static constexpr Operation kOperation = Operation::provision;
  static constexpr std::uint32_t kMostBytes = 8000;
  struct Request {
    std::string text{};
    static constexpr void fields(auto& self, auto&& field) {
      field("text", self.text, "of unit.toml, up to 8000 bytes");
    }
  };
  struct Answer {
    std::string serial_number{};
    static constexpr void fields(auto& self, auto&& field) {
      field("serial_number", self.serial_number, "that the box has from its next start on");
    }
  };
};

// Writes the keys of tls: links that the box has to itself. They are stored when it is answered, and in use within a
// minute.
struct ProvisionKeys {
  static constexpr Operation kOperation = Operation::provision_keys;
  static constexpr std::uint32_t kMostBytes = 3800;
  struct Request {
    std::string certificate{};
    std::string key{};
    std::string people_ca{};
    static constexpr void fields(auto& self, auto&& field) {
      field("certificate", self.certificate, "of the box, in PEM; all three have up to 3800 bytes");
      field("key", self.key, "of that certificate, in PEM");
      field("people_ca", self.people_ca, "in PEM, the CA whose certificates are persons'");
    }
  };
  using Answer = Nothing;
};

struct SphereCertificate {
  std::string serial_number{};
  double diameter_mm{};
  double expanded_uncertainty_um{};
  double coverage_factor{};
  std::string certificate{};
  std::string laboratory{};
  std::string date{};
  std::string next_due{};
  static constexpr void fields(auto& self, auto&& field) {
    field("serial_number", self.serial_number, "of the sphere");
    field("diameter_mm", self.diameter_mm, "mm, at 20 degrees C");
    field("expanded_uncertainty_um", self.expanded_uncertainty_um, "um, U of the diameter");
    field("coverage_factor", self.coverage_factor, "k of U");
    field("certificate", self.certificate, "its number");
    field("laboratory", self.laboratory, "who issued it");
    field("date", self.date, "of the calibration, such as 2026-04-17");
    field("next_due", self.next_due, "the first day without a valid calibration");
  }
};

struct DescribeUnit {
  static constexpr Operation kOperation = Operation::describe_unit;
  using Request = Nothing;
  struct Answer {
    bool provisioned{};
    bool in_use{};
    std::string serial_number{};
    std::string vendor{};
    std::string model{};
    std::string board{};
    std::uint16_t usb_vendor_id{};
    std::uint16_t usb_product_id{};
    std::vector<SphereCertificate> sphere{};
    std::vector<std::string> update_keys{};
    std::vector<std::string> notes{};
    std::vector<std::string> image_keys{};
    static constexpr void fields(auto& self, auto&& field) {
      field("provisioned", self.provisioned,
            "unit.toml was written into this box; otherwise all that follows is empty");
      field("in_use", self.in_use, "the box has started with it; 0 until the start that follows provisioning");
      field("serial_number", self.serial_number, "of the box");
      field("vendor", self.vendor, "who sells it, also the manufacturer on USB");
      field("model", self.model, "also the product on USB");
      field("board", self.board, "board_name that the unit was built with");
      field("usb_vendor_id", self.usb_vendor_id, "idVendor on USB");
      field("usb_product_id", self.usb_product_id, "idProduct on USB");
      field("sphere", self.sphere, "the calibrated sphere; none or one");
      field("update_keys", self.update_keys,
            "SHA-256, in hexadecimal, of the certificates whose updates its image takes, as unit.toml has them");
      field("notes", self.notes, "sentences for a person, such as that machine.toml has another sphere");
      field("image_keys", self.image_keys,
            "SHA-256, in hexadecimal, of the certificates whose updates the image in the box takes; none where it is "
            "no image");
    }
  };
};

}  // namespace probebox::messages
