"""A slider-crank as an SDF, with poses against several frames; a link with two parents."""

PRESS = """<?xml version="1.0"?>
<sdf version="1.9">
  <model name="press">
    <pose>0 0 1 0 0 0</pose>
    <link name="bed">
      <inertial><mass>50</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial>
      <visual name="v"><geometry><box><size>1 1 1</size></box></geometry></visual>
    </link>
    <joint name="bolts" type="fixed"><parent>world</parent><child>bed</child></joint>
    <frame name="pin" attached_to="bed"><pose degrees="true">0 0 0 90 0 0</pose></frame>
    <link name="crank">
      <pose relative_to="pin"/>
      <inertial>
        <pose>0.075 0 0 0 0 0</pose>
        <mass>0.36</mass>
        <inertia><ixx>1e-4</ixx><iyy>0.002727</iyy><izz>0.002727</izz></inertia>
      </inertial>
    </link>
    <link name="rod">
      <pose relative_to="crank">0.15 0 0 0 0 0</pose>
      <inertial>
        <pose>0.15 0 0 0 0 0</pose>
        <mass>0.15</mass>
        <inertia><ixx>1e-4</ixx><iyy>0.0045</iyy><izz>0.0045</izz></inertia>
      </inertial>
    </link>
    <link name="slider">
      <pose relative_to="crank">0.45 0 0 0 0 0</pose>
      <inertial>
        <mass>0.07</mass>
        <inertia><ixx>1e-4</ixx><iyy>1e-4</iyy><izz>1e-4</izz></inertia>
      </inertial>
    </link>
    <joint name="drive" type="revolute">
      <parent>bed</parent>
      <child>crank</child>
      <axis>
        <xyz expressed_in="pin">0 0 1</xyz>
        <limit><lower>-1e16</lower><upper>1e16</upper><effort>30</effort><velocity>-1</velocity></limit>
        <dynamics><damping>0.5</damping><friction>0.25</friction></dynamics>
      </axis>
    </joint>
    <joint name="knee" type="revolute">
      <parent>crank</parent>
      <child>rod</child>
      <axis><xyz>0 0 1</xyz></axis>
    </joint>
    <joint name="guide" type="prismatic">
      <parent>bed</parent>
      <child>slider</child>
      <axis><xyz>1 0 0</xyz><limit><lower>-0.4</lower><upper>0.1</upper></limit></axis>
    </joint>
    <joint name="wrist" type="revolute">
      <pose relative_to="slider"/>
      <parent>rod</parent>
      <child>slider</child>
      <axis><xyz>0 0 1</xyz></axis>
    </joint>
    <plugin name="p" filename="libp.so"/>
  </model>
</sdf>
"""
