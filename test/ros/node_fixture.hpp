// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "client.hpp"

namespace unirit::test {

/// Tests of the node named by the parameter ~node, which may be a nodelet. Each starts from an
/// accepted registration of a new cloud.
class Node : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    client_ = std::make_unique<Client>(ros::param::param<std::string>("~node", "/unirit"));
  }
  static void TearDownTestSuite() { client_.reset(); }

  void SetUp() override {
    client().sendOrgan(organCloud());
    accepted_ = client().sendAndRegister(truePose());
    ASSERT_EQ(accepted_.result.status, RegistrationResult::SUCCEEDED) << accepted_.result.message;
  }

  static Client& client() { return *client_; }

  /// Waits until both clouds of the accepted registration are here.
  bool waitForClouds() {
    return client().waitUntil([&] {
      const Points rigid = pointsOf(client().rigid);
      const Points expected =
          (poseOf(accepted_.result.transform) * organ().cast<double>()).cast<float>();
      return client().deformed.data == accepted_.deformed.data && rigid.cols() == expected.cols() &&
             (rigid - expected).cwiseAbs().maxCoeff() < 1e-6F;
    });
  }

  RegisterResponse accepted_;

 private:
  inline static std::unique_ptr<Client> client_;
};

inline bool names(const std::string& sentence, const std::string& words) {
  return sentence.find(words) != std::string::npos;
}

}  // namespace unirit::test
