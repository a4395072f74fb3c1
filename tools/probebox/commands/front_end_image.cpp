#include "tools/probebox/commands/front_end_image.hpp"

#include <algorithm>
#include <array>

#include "protocol/receiver/front_end.hpp"

namespace probebox::command {
namespace {

// https://github.com/microsoft/uf2: a block of 512 bytes has eight words, 476 bytes of data, and a word at its end.
constexpr std::size_t kBlockBytes = 512, kHeadBytes = 32, kDataBytes = 256;
constexpr std::uint32_t kMagicBegin = 0x0A324655, kMagicSecond = 0x9E5D5157, kMagicEnd = 0x0AB16F30;
constexpr std::uint32_t kHasFamily = 0x2000, kRp2040 = 0xE48BFF56, kFlashBegin = 0x10000000;

std::uint32_t wordAt(std::string_view bytes, std::size_t at) {
  std::uint32_t word = 0;
  for (std::size_t i = 4; i-- > 0;) word = word << 8U | static_cast<unsigned char>(bytes[at + i]);
  return word;
}

// The boot ROM's (RP2040 data sheet, 2.8.1.3.1): CRC-32, not reflected, begun with ones, not inverted at the end.
std::uint32_t bootChecksum(std::string_view bytes) {
  std::uint32_t crc = 0xFFFFFFFF;
  for (const char byte : bytes) {
    crc ^= static_cast<std::uint32_t>(static_cast<unsigned char>(byte)) << 24U;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 0x80000000U) != 0 ? crc << 1U ^ 0x04C11DB7U : crc << 1U;
  }
  return crc;
}

ImageFault damaged(std::size_t block) {
  return {"damaged-image", "block " + std::to_string(block) + " is damaged or missing: copy or build the file again"};
}

// The flash that the blocks make.
Outcome<std::string, ImageFault> flashOf(std::string_view file) {
  if (file.size() < kBlockBytes || wordAt(file, 0) != kMagicBegin || wordAt(file, 4) != kMagicSecond)
    return ImageFault{"not-uf2", "it is no UF2 file: give the front_end.uf2 that tools/front-end wrote"};
  const std::size_t blocks = file.size() / kBlockBytes;
  if (file.size() % kBlockBytes != 0) return damaged(blocks);
  std::string flash;
  for (std::size_t i = 0; i < blocks; ++i) {
    const auto block = file.substr(i * kBlockBytes, kBlockBytes);
    const bool framed = wordAt(block, 0) == kMagicBegin && wordAt(block, 4) == kMagicSecond &&
                        wordAt(block, kBlockBytes - 4) == kMagicEnd;
    if (!framed) return damaged(i);
    if ((wordAt(block, 8) & kHasFamily) == 0 || wordAt(block, 28) != kRp2040)
      return ImageFault{"another-chip",
                        "it is for another chip than the RP2040: give the front_end.uf2 that "
                        "tools/front-end wrote"};
    if (wordAt(block, 12) != kFlashBegin + flash.size() || wordAt(block, 16) != kDataBytes || wordAt(block, 20) != i ||
        wordAt(block, 24) != blocks)
      return damaged(i);
    flash += block.substr(kHeadBytes, kDataBytes);
  }
  return flash;
}

}  // namespace

Outcome<FrontEndImage, ImageFault> checkFrontEndImage(std::string_view file) {
  using front_end::ImageMark;
  TRY(const auto flash, flashOf(file));
  constexpr std::size_t kChecked = front_end::kBoot2Bytes - 4;
  if (bootChecksum(std::string_view{flash}.substr(0, kChecked)) != wordAt(flash, kChecked))
    return ImageFault{"bad-boot2",
                      "the checksum of its boot loader is wrong, and the chip would not start: build the "
                      "file again"};
  constexpr auto kMark = front_end::kImageMarkAt;
  const bool marked = flash.size() >= kMark + sizeof(ImageMark) &&
                      std::equal(ImageMark::kName.begin(), ImageMark::kName.end(), flash.begin() + kMark);
  if (!marked)
    return ImageFault{"not-a-front-end",
                      "it is another program than the front end's: give the front_end.uf2 that "
                      "tools/front-end wrote"};
  const auto versions = wordAt(flash, kMark + ImageMark::kName.size());
  return FrontEndImage{static_cast<std::uint16_t>(versions), flash.size()};
}

}  // namespace probebox::command
