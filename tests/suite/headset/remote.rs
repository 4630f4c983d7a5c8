//! Head and hands of Monado's remote driver: a record of poses and inputs, over TCP.

use bevy::prelude::*;
use std::{
    io::{Read, Write},
    net::TcpStream,
};

/// Bytes of a record, `r_remote_data` of Monado 25.
const RECORD: usize = 376;
/// Bytes in front of what the driver takes.
const MAGIC: &[u8; 8] = b"mndrmt3\0";
/// Place of the head's pose, bytes.
const HEAD: usize = 104;
/// Places of the left and the right hand, bytes.
const HANDS: [usize; 2] = [136, 256];
/// Places in a hand, bytes.
const TRIGGER: usize = 72;
const SQUEEZE: usize = 76;
const STICK: usize = 84;
const A_CLICK: usize = 108;
const B_CLICK: usize = 110;

/// The driver.
pub struct Remote {
    stream: TcpStream,
    record: [u8; RECORD],
}

/// What a hand does.
#[derive(Clone, Copy, Debug, Default)]
pub struct RemoteHand {
    pub pose: Transform,
    pub trigger: f32,
    pub grip: f32,
    pub stick: Vec2,
    pub shape: bool,
    pub operation: bool,
}

impl Remote {
    /// Connects to a driver on this machine.
    pub fn connect() -> std::io::Result<Self> {
        let mut stream = TcpStream::connect(("127.0.0.1", 4242))?;
        // It sends its state twice: at reset and now.
        let mut records = [0; 2 * RECORD];
        stream.read_exact(&mut records)?;
        let mut record = [0; RECORD];
        record.copy_from_slice(&records[RECORD..]);
        record[..MAGIC.len()].copy_from_slice(MAGIC);
        Ok(Self { stream, record })
    }

    fn put(&mut self, place: usize, values: &[f32]) {
        for (k, value) in values.iter().enumerate() {
            self.record[place + 4 * k..][..4].copy_from_slice(&value.to_le_bytes());
        }
    }

    fn put_pose(&mut self, place: usize, pose: Transform) {
        self.put(place, &pose.rotation.to_array());
        self.put(place + 16, &pose.translation.to_array());
    }

    /// Moves the head and both hands, left and right.
    pub fn send(&mut self, head: Transform, hands: [RemoteHand; 2]) -> std::io::Result<()> {
        self.put_pose(HEAD, head);
        for (place, hand) in HANDS.into_iter().zip(hands) {
            self.put_pose(place, hand.pose);
            self.put(place + TRIGGER, &[hand.trigger]);
            self.put(place + SQUEEZE, &[hand.grip]);
            self.put(place + STICK, &hand.stick.to_array());
            self.record[place + A_CLICK] = hand.shape.into();
            self.record[place + B_CLICK] = hand.operation.into();
        }
        self.stream.write_all(&self.record)
    }
}
