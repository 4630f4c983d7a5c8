//! Buttons of controllers. Runtimes map those of other controllers onto one of these profiles.

/// What a button does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Input {
    Aim,
    Grip,
    Trigger,
    Stick,
    StickPressed,
    Shape,
    Operation,
}

/// Inputs of one kind of controller.
pub struct Profile {
    pub path: &'static str,
    /// Inputs with their components, which both hands have.
    pub both: &'static [(Input, &'static str)],
    /// Inputs of the left and the right hand.
    pub sides: [&'static [(Input, &'static str)]; 2],
}

/// The hands' paths, left and right.
pub const HANDS: [&str; 2] = ["/user/hand/left", "/user/hand/right"];

pub const PROFILES: [Profile; 5] = [
    Profile {
        path: "/interaction_profiles/oculus/touch_controller",
        both: &[
            (Input::Aim, "input/aim/pose"),
            (Input::Grip, "input/squeeze/value"),
            (Input::Trigger, "input/trigger/value"),
            (Input::Stick, "input/thumbstick"),
            (Input::StickPressed, "input/thumbstick/click"),
        ],
        sides: [
            &[(Input::Shape, "input/x/click"), (Input::Operation, "input/y/click")],
            &[(Input::Shape, "input/a/click"), (Input::Operation, "input/b/click")],
        ],
    },
    Profile {
        path: "/interaction_profiles/valve/index_controller",
        both: &[
            (Input::Aim, "input/aim/pose"),
            (Input::Grip, "input/squeeze/value"),
            (Input::Trigger, "input/trigger/value"),
            (Input::Stick, "input/thumbstick"),
            (Input::StickPressed, "input/thumbstick/click"),
            (Input::Shape, "input/a/click"),
            (Input::Operation, "input/b/click"),
        ],
        sides: [&[], &[]],
    },
    Profile {
        path: "/interaction_profiles/microsoft/motion_controller",
        both: &[
            (Input::Aim, "input/aim/pose"),
            (Input::Grip, "input/squeeze/click"),
            (Input::Trigger, "input/trigger/value"),
            (Input::Stick, "input/thumbstick"),
            (Input::StickPressed, "input/thumbstick/click"),
            (Input::Shape, "input/trackpad/click"),
            (Input::Operation, "input/menu/click"),
        ],
        sides: [&[], &[]],
    },
    Profile {
        path: "/interaction_profiles/htc/vive_controller",
        both: &[
            (Input::Aim, "input/aim/pose"),
            (Input::Grip, "input/squeeze/click"),
            (Input::Trigger, "input/trigger/value"),
            (Input::Stick, "input/trackpad"),
            (Input::StickPressed, "input/trackpad/click"),
            (Input::Shape, "input/menu/click"),
        ],
        sides: [&[], &[]],
    },
    // It has two buttons alone, and no grip: things stay where they are.
    Profile {
        path: "/interaction_profiles/khr/simple_controller",
        both: &[
            (Input::Aim, "input/aim/pose"),
            (Input::Trigger, "input/select/click"),
            (Input::Shape, "input/menu/click"),
        ],
        sides: [&[], &[]],
    },
];

impl Profile {
    /// Full paths of an input.
    pub fn paths_of(&self, input: Input) -> Vec<String> {
        let of_side = |(hand, side): (&str, &[(Input, &str)])| {
            let components = self.both.iter().chain(side).filter(|(of, _)| *of == input);
            components.map(|(_, component)| format!("{hand}/{component}")).collect::<Vec<_>>()
        };
        HANDS.into_iter().zip(self.sides).flat_map(of_side).collect()
    }
}
