#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace probebox::app {

// SHA-256, in hexadecimal, of the certificates in a file of PEM blocks, as `openssl x509 -fingerprint -sha256` prints
// it without colons. What is no certificate is passed over.
std::vector<std::string> certificateFingerprints(std::string_view pem);

// Those whose updates the image takes; none where this is no image.
std::vector<std::string> imageKeys();

}  // namespace probebox::app
