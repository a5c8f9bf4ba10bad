// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "unirit/network/weights.hpp"

namespace unirit {

namespace fs = std::filesystem;
using Json = nlohmann::json;

/// A file taken apart, so that a test can damage one thing of it.
struct File {
  Json header;
  std::string data;

  std::string bytes() const {
    const std::string text = header.dump();
    const std::uint64_t length = text.size();
    return std::string(reinterpret_cast<const char*>(&length), sizeof(length)) + text + data;
  }
};

/// A folder with a good file in it, and means to write bad ones.
class WeightsFileTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = fs::temp_directory_path() / ("unirit_weights_test_" + std::to_string(getpid()));
    fs::create_directories(folder_);
    Weights weights = randomWeights(Pairing::kNearest, 1);
    weights.metadata["training_data"] = "a \"phantom\", 3 µm\n";
    writeWeights(weights, path("good"));
    std::ifstream stream(path("good"), std::ios::binary);
    std::ostringstream bytes;
    bytes << stream.rdbuf();
    good_ = bytes.str();
  }
  static void TearDownTestSuite() { fs::remove_all(folder_); }

  static std::string path(const std::string& name) {
    return (folder_ / (name + ".safetensors")).string();
  }

  static File goodFile() {
    std::uint64_t length = 0;
    std::memcpy(&length, good_.data(), sizeof(length));
    return {Json::parse(good_.substr(8, length)), good_.substr(8 + length)};
  }

  static std::string write(const std::string& bytes) {
    std::ofstream(path("bad"), std::ios::binary) << bytes;
    return path("bad");
  }

  inline static fs::path folder_;
  inline static std::string good_;
};

}  // namespace unirit
