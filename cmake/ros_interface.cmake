# Messages, services, dynamic parameters and where catkin wants things.

set(UNIRIT_CATKIN_DEPENDS
  diagnostic_msgs diagnostic_updater dynamic_reconfigure geometry_msgs nodelet pluginlib roscpp
  sensor_msgs std_msgs tf2 tf2_eigen tf2_msgs tf2_ros visualization_msgs)
#catkin_lint: ignore_once unsorted_list
find_package(catkin REQUIRED COMPONENTS message_generation ${UNIRIT_CATKIN_DEPENDS})

add_message_files(FILES Check.msg RegistrationResult.msg)
add_service_files(FILES DeformPoints.srv Register.srv)
generate_messages(DEPENDENCIES geometry_msgs sensor_msgs std_msgs)
generate_dynamic_reconfigure_options(cfg/Unirit.cfg)

#catkin_lint: ignore_once unsorted_list
catkin_package(
  INCLUDE_DIRS include
  LIBRARIES unirit_core unirit_io unirit_preprocessing unirit_simulation unirit_ros
  CATKIN_DEPENDS message_runtime ${UNIRIT_CATKIN_DEPENDS}
  DEPENDS EIGEN3)

set(UNIRIT_BINARY_DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
set(UNIRIT_LIBRARY_DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION})
set(UNIRIT_SHARE_DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})

install(DIRECTORY config launch rviz DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})
install(FILES nodelet_plugins.xml DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})
