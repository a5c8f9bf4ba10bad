// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cstring>

#include "weights_file_test.hpp"

namespace unirit {
namespace {

constexpr char kFirst[] = "nonrigid.decoder.0.bias";  // the first tensor of the file's data
constexpr char kSecond[] = "nonrigid.decoder.0.weight";

class DamagedWeightsFile : public WeightsFileTest {
 protected:
  /// The file must be refused in a sentence that has these words and names the file.
  static void expectRefused(const std::string& file, const std::vector<std::string>& words) {
    try {
      readWeights(file);
      ADD_FAILURE() << "was read: " << words.front();
    } catch (const std::runtime_error& fault) {
      const std::string sentence = fault.what();
      EXPECT_NE(sentence.find(file), std::string::npos) << sentence;
      for (const std::string& word : words) {
        EXPECT_NE(sentence.find(word), std::string::npos) << sentence;
      }
    }
  }

  static void expectBytesRefused(const std::string& bytes, const std::vector<std::string>& words) {
    expectRefused(write(bytes), words);
  }

  /// Puts a half of these bits in the place of the first tensor's first number.
  static std::string withFirstHalf(std::uint16_t bits) {
    File file = goodFile();
    std::memcpy(file.data.data(), &bits, sizeof(bits));
    return file.bytes();
  }
};

TEST_F(DamagedWeightsFile, thatIsNoFileIsRefused) {
  expectRefused(path("missing"), {"does not exist"});
  expectRefused(folder_.string(), {"not a regular file"});
  expectBytesRefused("", {"is empty"});
  fs::resize_file(write("x"), 1U << 30U);
  expectRefused(path("bad"), {"too large"});
}

TEST_F(DamagedWeightsFile, thatIsTruncatedIsRefused) {
  expectBytesRefused(good_.substr(0, 5), {"truncated", "at least 8 bytes"});
  expectBytesRefused(good_.substr(0, 500), {"truncated", "header"});
  expectBytesRefused(good_.substr(0, good_.size() - 1), {"truncated", "tensor"});
}

TEST_F(DamagedWeightsFile, whoseHeaderIsLongerThanTheFileIsRefused) {
  std::string bytes = good_;
  bytes.replace(0, 8, 8, '\xFF');
  expectBytesRefused(bytes, {"header claims 18446744073709551615 bytes"});
}

TEST_F(DamagedWeightsFile, thatIsNotSafetensorsIsRefused) {
  expectBytesRefused("ply\nformat ascii 1.0\nend_header\n", {"not safetensors"});
  expectBytesRefused(File{"text", ""}.bytes(), {"not safetensors", "JSON object"});
  std::string bytes = good_;
  bytes[8] = '[';
  expectBytesRefused(bytes, {"not safetensors", "JSON object"});
  File file = goodFile();
  file.header[kFirst] = 7;
  expectBytesRefused(file.bytes(), {"not safetensors", "no dtype", kFirst});
  file = goodFile();
  file.header[kFirst]["shape"] = {-1};
  expectBytesRefused(file.bytes(), {"not safetensors", "shape", kFirst});
  file = goodFile();
  file.header[kFirst]["data_offsets"] = {2048, 0};
  expectBytesRefused(file.bytes(), {"not safetensors", "not a range", kFirst});
  file = goodFile();
  file.header["__metadata__"]["pairing"] = 1;
  expectBytesRefused(file.bytes(), {"not safetensors", "metadata", "pairing"});
}

TEST_F(DamagedWeightsFile, ofAnotherArchitectureIsRefused) {
  File file = goodFile();
  file.header["__metadata__"]["architecture"] = "pointnet";
  expectBytesRefused(file.bytes(), {"another architecture"});
  file = goodFile();
  file.header.erase("__metadata__");
  expectBytesRefused(file.bytes(), {"another architecture"});
  file = goodFile();
  file.header["__metadata__"].erase("pairing");
  expectBytesRefused(file.bytes(), {"lacks the metadata", "pairing"});
  file = goodFile();
  file.header["__metadata__"]["pairing"] = "closest";
  expectBytesRefused(file.bytes(), {"unknown pairing", "closest"});
}

TEST_F(DamagedWeightsFile, withATensorMissingExtraOrMisnamedIsRefused) {
  File file = goodFile();
  file.data.erase(0, 2048);
  file.header.erase(kFirst);
  for (auto& [name, entry] : file.header.items()) {
    if (name != "__metadata__") {
      for (auto& offset : entry["data_offsets"]) {
        offset = offset.get<std::size_t>() - 2048;
      }
    }
  }
  expectBytesRefused(file.bytes(), {"lacks the tensor", kFirst});

  file = goodFile();
  file.header["rigid.decoder.6.bias"] = {
      {"dtype", "F16"}, {"shape", {1}}, {"data_offsets", {file.data.size(), file.data.size() + 2}}};
  file.data += "xx";
  expectBytesRefused(file.bytes(), {"does not know", "rigid.decoder.6.bias"});

  file = goodFile();
  file.header["nonrigid.decoder.0.offset"] = file.header[kFirst];
  file.header.erase(kFirst);
  expectBytesRefused(file.bytes(), {"lacks the tensor", kFirst});
}

TEST_F(DamagedWeightsFile, withATensorOfWrongShapeOrTypeIsRefused) {
  File file = goodFile();
  file.header[kFirst]["shape"] = {1023};
  expectBytesRefused(file.bytes(), {kFirst, "[1023]", "[1024]"});
  file = goodFile();
  file.header[kSecond]["shape"] = {2054, 1024};
  expectBytesRefused(file.bytes(), {kSecond, "[2054, 1024]", "[1024, 2054]"});
  file = goodFile();
  file.header[kFirst]["dtype"] = "BF16";
  expectBytesRefused(file.bytes(), {kFirst, "BF16", "neither F16 nor F32"});
  file = goodFile();
  file.header[kFirst]["dtype"] = "F32";
  expectBytesRefused(file.bytes(), {kFirst, "damaged", "2048 bytes"});
}

TEST_F(DamagedWeightsFile, whoseTensorsOverlapOrLeaveGapsIsRefused) {
  File file = goodFile();
  file.header[kFirst]["data_offsets"] = {0, 2050};
  expectBytesRefused(file.bytes(), {"damaged", "overlaps"});
  file = goodFile();
  file.header[kFirst]["data_offsets"] = {0, 2046};
  expectBytesRefused(file.bytes(), {"damaged", "no tensor claims", kSecond});
  file = goodFile();
  file.data += "further bytes";
  expectBytesRefused(file.bytes(), {"damaged", "follow the last tensor"});
  file = goodFile();
  file.header[kFirst]["data_offsets"] = {std::uint64_t{0}, ~std::uint64_t{0}};
  expectBytesRefused(file.bytes(), {"truncated", kFirst});
}

TEST_F(DamagedWeightsFile, withAValueThatIsNotFiniteIsRefused) {
  expectBytesRefused(withFirstHalf(0x7E00), {"not finite", kFirst});  // NaN
  expectBytesRefused(withFirstHalf(0xFC00), {"not finite", kFirst});  // -infinity
  EXPECT_EQ(readWeights(write(withFirstHalf(0x7BFF))).layers.at("nonrigid.decoder.0").bias[0],
            65504.0F);
}

}  // namespace
}  // namespace unirit
