"""recoil"""
