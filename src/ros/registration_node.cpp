// SPDX-License-Identifier: BSD-3-Clause
#include <ros/ros.h>

#include "registration_server.hpp"

/// The registration as a node of its own.
int main(int argc, char** argv) {
  ros::init(argc, argv, "unirit");
  const unirit::RegistrationServer server{ros::NodeHandle(), ros::NodeHandle("~")};
  ros::waitForShutdown();
  return 0;
}
